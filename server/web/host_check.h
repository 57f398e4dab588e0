#pragma once

// Lets in only requests that mean this daemon, and only pages of its own: a foreign page must not
// reach it through its visitor's browser, neither directly nor under a name of its own that it
// makes resolve to this machine (DNS rebinding).

#include <absl/status/status.h>

#include <string>
#include <vector>

#include "server/web/http_message.h"

namespace polyest::internal {

class HostCheck {
 public:
  // `listen_host` is the host that is listened on; `names` are other names of this daemon, which
  // proxies and browsers may use.
  HostCheck(std::string listen_host, std::vector<std::string> names);

  // Refuses with INVALID_ARGUMENT a request without one Host, and with PERMISSION_DENIED one whose
  // Host is not loopback, the address that was reached or listened on, or one of the names, and one
  // whose Origin is another than its Host.
  absl::Status Check(const HttpRequest& request) const;

 private:
  bool IsKnown(const std::string& host, const HttpRequest& request) const;

  std::vector<std::string> names_;  // in lower case
};

}  // namespace polyest::internal
