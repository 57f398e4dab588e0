#include "server/web/host_check.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

#include <algorithm>
#include <utility>

#include "proto/wire/transport/loopback.h"

namespace polyest::internal {
namespace {

// Returns the host of HOST or HOST:PORT in lower case, IPv6 in its brackets.
std::string HostOf(const std::string& authority) {
  const size_t colon = authority.rfind(':');
  const size_t bracket = authority.rfind(']');
  const bool has_port =
      colon != std::string::npos && (bracket == std::string::npos || colon > bracket);
  return absl::AsciiStrToLower(authority.substr(0, has_port ? colon : std::string::npos));
}

// Returns whether the origin of a page is the authority that its request names.
bool IsOrigin(absl::string_view origin, const std::string& authority) {
  return (absl::ConsumePrefix(&origin, "http://") || absl::ConsumePrefix(&origin, "https://")) &&
         absl::EqualsIgnoreCase(origin, authority);
}

}  // namespace

HostCheck::HostCheck(std::string listen_host, std::vector<std::string> names)
    : names_(std::move(names)) {
  // These two stand for all addresses; no client calls the daemon by them.
  if (listen_host != "0.0.0.0" && listen_host != "[::]") names_.push_back(std::move(listen_host));
  for (std::string& name : names_) absl::AsciiStrToLower(&name);
}

bool HostCheck::IsKnown(const std::string& host, const HttpRequest& request) const {
  return IsLoopback(host) || host == request.local_host ||
         std::find(names_.begin(), names_.end(), host) != names_.end();
}

absl::Status HostCheck::Check(const HttpRequest& request) const {
  const std::optional<std::string> authority = request.Header("Host");
  if (!authority) return absl::InvalidArgumentError("the request needs exactly one Host");
  if (!IsKnown(HostOf(*authority), request)) {
    return absl::PermissionDeniedError(
        "the daemon does not go by this Host; the option --web-host adds names");
  }
  if (request.headers.count("Origin") == 0) return absl::OkStatus();
  if (!IsOrigin(request.Header("Origin").value_or(""), *authority)) {
    return absl::PermissionDeniedError("pages of another origin may not call the daemon");
  }
  return absl::OkStatus();
}

}  // namespace polyest::internal
