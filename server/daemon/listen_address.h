#pragma once

#include <absl/status/statusor.h>

#include <string>

namespace polyest::internal {

// Is an address HOST:PORT, where HOST is a name, an IPv4 address or an IPv6 address in brackets.
struct ListenAddress {
  std::string host;  // with its brackets
  int port = 0;      // 0: any free one

  // Parses HOST:PORT; INVALID_ARGUMENT for anything else. `flag` is the option that gave the text.
  static absl::StatusOr<ListenAddress> Parse(const std::string& text,
                                             const std::string& flag = "--listen");
  std::string ToString() const;
};

}  // namespace polyest::internal
