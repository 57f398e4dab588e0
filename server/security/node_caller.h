#pragma once

// Tells another daemon of the same database, as metadata, whose call this daemon passes on to it.
// The token goes with the call as it came, so that the other daemon checks it by itself; a secret
// that the daemons share lets it believe the rest.

#include <absl/status/statusor.h>
#include <grpcpp/server_context.h>

#include <string>
#include <utility>
#include <vector>

#include "server/security/token.h"

namespace polyest::internal {

// Is shared by the daemons of a database.
class NodeSecret {
 public:
  // Reads the secret from the only line of a file. INVALID_ARGUMENT unless that has 32 to 256
  // printable characters of ASCII and no blanks; NOT_FOUND when there is no such file.
  static absl::StatusOr<NodeSecret> Read(const std::string& file);

  const std::string& text() const { return text_; }
  bool IsSame(absl::string_view text) const { return SameDigest(DigestOf(text), digest_); }

 private:
  explicit NodeSecret(absl::string_view text) : text_(text), digest_(DigestOf(text_)) {}

  std::string text_;
  TokenDigest digest_;
};

// A caller whose call is passed on.
struct NodeCaller {
  std::string peer;                // its address, "ipv4:192.0.2.7:50123"
  std::string certificate_name{};  // the common name of its certificate, escaped; empty: none
};

// Returns the metadata of a call that is passed on for a caller.
std::vector<std::pair<std::string, std::string>> MetadataOf(const NodeCaller& caller,
                                                            const NodeSecret& secret);

// Returns whether a call says that another daemon has passed it on. Whoever says so without the
// secret must be refused: were the call passed on again, it could go in circles.
bool ClaimsToBePassedOn(const grpc::ServerContextBase& call);

// Returns whether another daemon that knows the secret has passed the call on.
bool IsPassedOnWith(const grpc::ServerContextBase& call, const NodeSecret& secret);

// Returns the caller of a call that has been passed on.
NodeCaller CallerPassedOn(const grpc::ServerContextBase& call);

}  // namespace polyest::internal
