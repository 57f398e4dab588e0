#include "server/security/peer.h"

#include <absl/strings/escaping.h>
#include <absl/strings/match.h>

#include "server/security/metadata.h"

namespace polyest::internal {

bool IsLoopbackPeer(const std::string& peer) {
  return absl::StartsWith(peer, "ipv4:127.") || absl::StartsWith(peer, "ipv6:[::1]:") ||
         absl::StartsWith(peer, "ipv6:%5B::1%5D:");
}

std::optional<std::string> EdgeHeader(const grpc::ServerContextBase& call, const char* key) {
  const std::optional<std::string> value = OnlyValue(call, key);
  if (!value || value->empty()) return std::nullopt;
  return absl::CEscape(*value);
}

}  // namespace polyest::internal
