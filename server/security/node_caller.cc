#include "server/security/node_caller.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>

#include <algorithm>

#include "core/common/status.h"
#include "proto/wire/transport/file_text.h"
#include "server/security/metadata.h"

namespace polyest::internal {
namespace {

constexpr char kNodeSecretKey[] = "x-polyest-node-secret";
constexpr char kNodePeerKey[] = "x-polyest-node-peer";
constexpr char kNodeCertificateKey[] = "x-polyest-node-certificate";
constexpr size_t kShortestSecret = 32;
constexpr size_t kLongestSecret = 256;

}  // namespace

absl::StatusOr<NodeSecret> NodeSecret::Read(const std::string& file) {
  POLYEST_ASSIGN_OR_RETURN(const std::string content, ReadFileText(file));
  const absl::string_view text = absl::StripTrailingAsciiWhitespace(content);
  if (text.size() < kShortestSecret || text.size() > kLongestSecret ||
      !std::all_of(text.begin(), text.end(), absl::ascii_isgraph)) {
    return absl::InvalidArgumentError(absl::StrCat(file, " must have one line of ", kShortestSecret,
                                                   " to ", kLongestSecret,
                                                   " printable characters without blanks"));
  }
  return NodeSecret(text);
}

std::vector<std::pair<std::string, std::string>> MetadataOf(const NodeCaller& caller,
                                                            const NodeSecret& secret) {
  std::vector<std::pair<std::string, std::string>> metadata = {{kNodeSecretKey, secret.text()},
                                                               {kNodePeerKey, caller.peer}};
  if (!caller.certificate_name.empty()) {
    metadata.emplace_back(kNodeCertificateKey, caller.certificate_name);
  }
  return metadata;
}

bool ClaimsToBePassedOn(const grpc::ServerContextBase& call) {
  return call.client_metadata().count(kNodeSecretKey) > 0;
}

bool IsPassedOnWith(const grpc::ServerContextBase& call, const NodeSecret& secret) {
  const std::optional<std::string> claimed = OnlyValue(call, kNodeSecretKey);
  return claimed && secret.IsSame(*claimed);
}

NodeCaller CallerPassedOn(const grpc::ServerContextBase& call) {
  return {OnlyValue(call, kNodePeerKey).value_or(""),
          OnlyValue(call, kNodeCertificateKey).value_or("")};
}

}  // namespace polyest::internal
