#pragma once

// Identifies callers and decides which methods they may call.

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <grpcpp/server_context.h>

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/security/caller.h"
#include "server/security/method_roles.h"
#include "server/security/node_caller.h"
#include "server/security/token_table.h"

namespace polyest::internal {

struct AccessOptions {
  std::string token_file{};          // empty: no tokens are asked for
  bool client_certificates = false;  // the transport lets in only clients that have one
  bool behind_edge = false;          // callers on loopback are an edge that says who calls (peer.h)
  // The secret by which the daemons of a database believe what they say of their callers
  // (node_caller.h); none: nobody is believed.
  std::optional<NodeSecret> nodes{};
};

// Holds what a call says about its caller.
struct Identification {
  std::optional<std::string> authorization{};     // the header; none unless there is exactly one
  std::optional<std::string> certificate_name{};  // the common name of the client's certificate
};

// Thread-safe.
class AccessControl {
 public:
  // Reads the tokens, if there is a file of them; errors are those of TokenTable::Read.
  static absl::StatusOr<std::unique_ptr<AccessControl>> Open(AccessOptions options);

  // Returns the caller, who may be another daemon's that passes the call on. UNAUTHENTICATED
  // without a known token, where tokens are asked for, and for a false secret of the daemons;
  // PERMISSION_DENIED when the caller's role may not call the method. With client certificates
  // alone, their holders are operators in the tenant "default"; without authentication everybody
  // is.
  absl::StatusOr<Caller> Authorize(const grpc::ServerContextBase& call, Method method) const;
  absl::StatusOr<Caller> Authorize(const Identification& identification, Method method) const;

  // Returns where a call comes from, as the daemon that has passed it on or the edge says if there
  // is one.
  std::string PeerOf(const grpc::ServerContextBase& call) const;

  // Returns whether another daemon of the database has passed the call on.
  bool IsPassedOn(const grpc::ServerContextBase& call) const;
  // Returns what to say of a call's caller, as metadata, when the call is passed on to another
  // daemon of the database. To be called only if there are such daemons.
  std::vector<std::pair<std::string, std::string>> PassOn(
      const grpc::ServerContextBase& call) const;

  // Reads the tokens again; keeps the old ones if that fails.
  absl::Status Reload();

 private:
  explicit AccessControl(AccessOptions options) : options_(std::move(options)) {}

  Identification IdentificationOf(const grpc::ServerContextBase& call) const;
  absl::StatusOr<Caller> Identify(const Identification& identification) const;
  std::shared_ptr<const TokenTable> tokens() const;

  const AccessOptions options_;
  mutable std::mutex mutex_;
  std::shared_ptr<const TokenTable> tokens_;  // null when none are asked for
};

}  // namespace polyest::internal
