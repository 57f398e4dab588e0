#include "server/daemon/listen_address.h"

#include <absl/strings/ascii.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>

namespace polyest::internal {
namespace {

constexpr int kMaxPort = 65'535;

bool IsHost(const std::string& host) {
  const bool bracketed = host.starts_with('[');
  const std::string inner =
      bracketed && host.ends_with(']') ? host.substr(1, host.size() - 2) : host;
  return !inner.empty() && std::all_of(inner.begin(), inner.end(), [&](unsigned char c) {
    return absl::ascii_isalnum(c) || c == '.' || c == '-' || (bracketed && (c == ':' || c == '%'));
  });
}

bool IsPort(const std::string& port) {
  return !port.empty() && port.size() <= 5 &&
         std::all_of(port.begin(), port.end(),
                     [](unsigned char c) { return absl::ascii_isdigit(c); });
}

}  // namespace

absl::StatusOr<ListenAddress> ListenAddress::Parse(const std::string& text,
                                                   const std::string& flag) {
  const size_t colon = text.rfind(':');
  if (colon != std::string::npos) {
    const std::string port = text.substr(colon + 1);
    ListenAddress address{text.substr(0, colon), 0};
    if (IsHost(address.host) && IsPort(port) && absl::SimpleAtoi(port, &address.port) &&
        address.port <= kMaxPort) {
      return address;
    }
  }
  return absl::InvalidArgumentError(absl::StrFormat(
      "%s: \"%s\" must be HOST:PORT with a port from 0 to %d, as in 127.0.0.1:50051 or "
      "[::1]:50051",
      flag, text, kMaxPort));
}

std::string ListenAddress::ToString() const { return absl::StrCat(host, ":", port); }

}  // namespace polyest::internal
