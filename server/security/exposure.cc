#include "server/security/exposure.h"

#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <arpa/inet.h>
#include <netinet/in.h>

namespace polyest {

bool IsLoopback(const std::string& host) {
  if (absl::EqualsIgnoreCase(host, "localhost")) return true;
  in_addr ipv4;
  if (inet_pton(AF_INET, host.c_str(), &ipv4) == 1) return ntohl(ipv4.s_addr) >> 24 == 127;
  const bool bracketed = host.size() > 2 && host.front() == '[' && host.back() == ']';
  const std::string inner = bracketed ? host.substr(1, host.size() - 2) : host;
  in6_addr ipv6;
  return inet_pton(AF_INET6, inner.c_str(), &ipv6) == 1 && IN6_IS_ADDR_LOOPBACK(&ipv6);
}

absl::Status CheckExposure(const Exposure& exposure) {
  if (exposure.insecure || IsLoopback(exposure.host)) return absl::OkStatus();
  if (exposure.tls && exposure.authentication) return absl::OkStatus();
  const char* const tls = "--tls-certificate and --tls-key";
  const char* const authentication = "--tokens or --tls-client-ca";
  std::string missing;
  if (!exposure.tls) missing = tls;
  if (!exposure.authentication) {
    absl::StrAppend(&missing, missing.empty() ? "" : ", and ", authentication);
  }
  return absl::FailedPreconditionError(absl::StrCat("--listen: ", exposure.host,
                                                    " is beyond loopback, which needs ", missing,
                                                    "; --insecure does without"));
}

}  // namespace polyest
