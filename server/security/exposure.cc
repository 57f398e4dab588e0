#include "server/security/exposure.h"

#include <absl/strings/str_cat.h>

#include "proto/wire/transport/loopback.h"

namespace polyest::internal {

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
  return absl::FailedPreconditionError(absl::StrCat(exposure.option, ": ", exposure.host,
                                                    " is beyond loopback, which needs ", missing,
                                                    "; --insecure does without"));
}

}  // namespace polyest::internal
