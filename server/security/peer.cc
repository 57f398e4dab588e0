#include "server/security/peer.h"

#include <absl/strings/escaping.h>
#include <absl/strings/match.h>
#include <absl/strings/string_view.h>

namespace polyest::internal {

bool IsLoopbackPeer(const std::string& peer) {
  return absl::StartsWith(peer, "ipv4:127.") || absl::StartsWith(peer, "ipv6:[::1]:") ||
         absl::StartsWith(peer, "ipv6:%5B::1%5D:");
}

std::optional<std::string> EdgeHeader(const grpc::ServerContextBase& call, const char* key) {
  const auto& metadata = call.client_metadata();
  if (metadata.count(key) != 1) return std::nullopt;
  const grpc::string_ref value = metadata.find(key)->second;
  if (value.empty()) return std::nullopt;
  return absl::CEscape(absl::string_view(value.data(), value.size()));
}

}  // namespace polyest::internal
