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
#include "server/security/metadata.h"
#include "server/security/peer.h"

namespace polyest::internal {
namespace {

constexpr absl::string_view kScheme = "Bearer ";
constexpr char kAuthorizationKey[] = "authorization";

// Returns the common name of the certificate of the caller, or of the client for whom the HTTP port
// or the edge calls; none without a certificate.
std::optional<std::string> CertificateNameOf(const grpc::ServerContextBase& call,
                                             bool behind_edge) {
  std::optional<std::string> name;
  const std::string web_certificate = WebCertificateOf(call);
  if (!web_certificate.empty()) name = web_certificate;
  if (behind_edge && IsFromEdge(call)) name = EdgeHeader(call, kCertificateNameKey);
  const auto transport = call.auth_context();
  if (transport != nullptr) {
    const auto names = transport->FindPropertyValues(GRPC_X509_CN_PROPERTY_NAME);
    if (!names.empty()) {
      // The name is escaped because it goes into logs, and its signer may not have looked at it
      // closely.
      name = absl::CEscape(absl::string_view(names.front().data(), names.front().size()));
    }
  }
  return name;
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

Identification AccessControl::IdentificationOf(const grpc::ServerContextBase& call) const {
  Identification identification{.authorization = OnlyValue(call, kAuthorizationKey)};
  if (IsPassedOn(call)) {
    // The certificate of the connection is the other daemon's.
    const std::string name = CallerPassedOn(call).certificate_name;
    if (!name.empty()) identification.certificate_name = name;
  } else {
    identification.certificate_name = CertificateNameOf(call, options_.behind_edge);
  }
  return identification;
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
  if (ClaimsToBePassedOn(call) && !IsPassedOn(call)) {
    return absl::UnauthenticatedError(
        "the call was passed on with a secret that is not that of this daemon (--node-secret)");
  }
  return Authorize(IdentificationOf(call), method);
}

bool AccessControl::IsPassedOn(const grpc::ServerContextBase& call) const {
  return options_.nodes && IsPassedOnWith(call, *options_.nodes);
}

std::vector<std::pair<std::string, std::string>> AccessControl::PassOn(
    const grpc::ServerContextBase& call) const {
  std::vector<std::pair<std::string, std::string>> metadata =
      MetadataOf(NodeCaller{PeerOf(call), IdentificationOf(call).certificate_name.value_or("")},
                 *options_.nodes);
  const auto [first, last] = call.client_metadata().equal_range(kAuthorizationKey);
  for (auto value = first; value != last; ++value) {
    metadata.emplace_back(kAuthorizationKey,
                          std::string(value->second.data(), value->second.size()));
  }
  return metadata;
}

std::string AccessControl::PeerOf(const grpc::ServerContextBase& call) const {
  if (IsPassedOn(call)) return CallerPassedOn(call).peer;
  const std::optional<std::string> forwarded =
      options_.behind_edge && IsFromEdge(call) ? EdgeHeader(call, kForwardedForKey) : std::nullopt;
  return forwarded ? absl::StrCat("edge:", *forwarded) : ClientAddressOf(call);
}

}  // namespace polyest::internal
