#include "server/security/access_control.h"

#include <absl/strings/escaping.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/string_view.h>
#include <grpc/grpc_security_constants.h>

#include <utility>

#include "core/common/check.h"
#include "core/common/status.h"
#include "server/security/in_process_caller.h"
#include "server/security/peer.h"

namespace polyest::internal {
namespace {

constexpr absl::string_view kScheme = "Bearer ";

Identification IdentificationOf(const grpc::ServerContextBase& call, bool behind_edge) {
  Identification identification;
  const auto& metadata = call.client_metadata();
  if (metadata.count("authorization") == 1) {
    const grpc::string_ref value = metadata.find("authorization")->second;
    identification.authorization.emplace(value.data(), value.size());
  }
  const std::string web_certificate = WebCertificateOf(call);
  if (!web_certificate.empty()) identification.certificate_name = web_certificate;
  if (behind_edge && IsFromEdge(call)) {
    identification.certificate_name = EdgeHeader(call, kCertificateNameKey);
  }
  const auto transport = call.auth_context();
  if (transport != nullptr) {
    const auto names = transport->FindPropertyValues(GRPC_X509_CN_PROPERTY_NAME);
    if (!names.empty()) {
      // The name is escaped because it goes into logs, and its signer may not have looked at it
      // closely.
      identification.certificate_name =
          absl::CEscape(absl::string_view(names.front().data(), names.front().size()));
    }
  }
  return identification;
}

}  // namespace

absl::StatusOr<std::unique_ptr<AccessControl>> AccessControl::Open(AccessOptions options) {
  std::unique_ptr<AccessControl> control(new AccessControl(std::move(options)));
  POLYEST_CHECK(CoversAllMethods(Services()));
  POLYEST_RETURN_IF_ERROR(control->Reload());
  return control;
}

absl::Status AccessControl::Reload() {
  if (options_.token_file.empty()) return absl::OkStatus();
  absl::StatusOr<TokenTable> table = TokenTable::Read(options_.token_file);
  if (!table.ok()) {
    return absl::Status(table.status().code(),
                        absl::StrCat("--tokens: ", table.status().message()));
  }
  auto tokens = std::make_shared<const TokenTable>(*std::move(table));
  const std::lock_guard lock(mutex_);
  tokens_.swap(tokens);
  return absl::OkStatus();
}

std::shared_ptr<const TokenTable> AccessControl::tokens() const {
  const std::lock_guard lock(mutex_);
  return tokens_;
}

absl::StatusOr<Caller> AccessControl::Identify(const Identification& identification) const {
  const auto known = tokens();
  if (known == nullptr) {
    Caller caller;
    if (options_.client_certificates || identification.certificate_name) {
      caller.name = identification.certificate_name.value_or("unnamed");
    }
    return caller;
  }
  const absl::string_view authorization =
      identification.authorization ? *identification.authorization : absl::string_view();
  if (!absl::StartsWithIgnoreCase(authorization, kScheme)) {
    return absl::UnauthenticatedError("a token is needed");
  }
  const std::optional<Caller> caller = known->Find(authorization.substr(kScheme.size()));
  if (!caller) return absl::UnauthenticatedError("the token is not known");
  return *caller;
}

absl::StatusOr<Caller> AccessControl::Authorize(const Identification& identification,
                                                Method method) const {
  POLYEST_ASSIGN_OR_RETURN(Caller caller, Identify(identification));
  if (caller.role < method.needed()) {
    return absl::PermissionDeniedError(absl::StrFormat("%s needs the role %s, the token has %s",
                                                       method.name(), RoleName(method.needed()),
                                                       RoleName(caller.role)));
  }
  return caller;
}

absl::StatusOr<Caller> AccessControl::Authorize(const grpc::ServerContextBase& call,
                                                Method method) const {
  return Authorize(IdentificationOf(call, options_.behind_edge), method);
}

std::string AccessControl::PeerOf(const grpc::ServerContextBase& call) const {
  const std::optional<std::string> forwarded =
      options_.behind_edge && IsFromEdge(call) ? EdgeHeader(call, kForwardedForKey) : std::nullopt;
  return forwarded ? absl::StrCat("edge:", *forwarded) : polyest::internal::PeerOf(call);
}

}  // namespace polyest::internal
