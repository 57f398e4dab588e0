#include "server/security/in_process_caller.h"

#include <map>

#include "server/security/metadata.h"
#include "server/security/token.h"

namespace polyest::internal {
namespace {

constexpr char kPeerKey[] = "x-polyest-web-peer";
constexpr char kCertificateKey[] = "x-polyest-web-certificate";
constexpr char kSecretKey[] = "x-polyest-web-secret";

// Is what only this process knows.
struct Secret {
  const std::string text = MakeToken();
  const TokenDigest digest = DigestOf(text);
};

const Secret& ProcessSecret() {
  static const Secret secret;
  return secret;
}

// Returns the value of a key that the HTTP port has set; empty for a call that is not its own.
std::string BelievedValue(const grpc::ServerContextBase& call, const char* key) {
  const std::optional<std::string> secret = OnlyValue(call, kSecretKey);
  const bool own = secret && SameDigest(DigestOf(*secret), ProcessSecret().digest);
  return own ? OnlyValue(call, key).value_or("") : "";
}

}  // namespace

std::vector<std::pair<std::string, std::string>> MetadataOf(const WebClient& client) {
  std::vector<std::pair<std::string, std::string>> metadata = {{kSecretKey, ProcessSecret().text},
                                                               {kPeerKey, client.peer}};
  if (!client.certificate_name.empty()) {
    metadata.emplace_back(kCertificateKey, client.certificate_name);
  }
  return metadata;
}

std::string ClientAddressOf(const grpc::ServerContextBase& call) {
  const std::string peer = BelievedValue(call, kPeerKey);
  return peer.empty() ? call.peer() : peer;
}

std::string WebCertificateOf(const grpc::ServerContextBase& call) {
  return BelievedValue(call, kCertificateKey);
}

}  // namespace polyest::internal
