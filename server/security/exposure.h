#pragma once

// Where one may listen, and where a secret may be sent, without encryption.

#include <absl/status/status.h>

#include <string>

namespace polyest::internal {

struct Exposure {
  std::string host;  // to listen on
  bool tls = false;
  bool authentication = false;  // by tokens or certificates
  bool insecure = false;        // the user's express wish
};

// FAILED_PRECONDITION, naming what is missing, beyond loopback without both, unless it is wished.
absl::Status CheckExposure(const Exposure& exposure);

}  // namespace polyest::internal
