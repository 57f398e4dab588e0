#pragma once

// Decides on which addresses the daemon may listen without encryption or authentication.

#include <absl/status/status.h>

#include <string>

namespace polyest::internal {

struct Exposure {
  std::string host;  // to listen on
  bool tls = false;
  bool authentication = false;      // by tokens or certificates
  bool insecure = false;            // whether the user wants to do without (--insecure)
  const char* option = "--listen";  // that names the host
};

// Refuses with FAILED_PRECONDITION, naming what is missing, a host beyond loopback without both TLS
// and authentication, unless `insecure` is set.
absl::Status CheckExposure(const Exposure& exposure);

}  // namespace polyest::internal
