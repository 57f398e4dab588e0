#include "server/forwarding/node_channels.h"

#include <absl/strings/str_cat.h>
#include <grpcpp/create_channel.h>
#include <grpcpp/security/credentials.h>

#include <utility>

#include "core/common/status.h"
#include "proto/wire/transport/file_text.h"

namespace polyest::internal {
namespace {

// A daemon takes 1,000 calls of a connection at a time; more would wait without a word. A call
// holds at least one reference to its channel.
constexpr int kMaxReferences = 900;
// While calls are passed on, a daemon whose computer is away or stands still is noticed soon after
// its lease has ended, so that the calls end and their clients come back to the next owner.
constexpr int kPingMs = 2'000;
constexpr int kPingTimeoutMs = 3'000;
// Longest time until the next attempt to reach a daemon that was away.
constexpr int kLongestBackoffMs = 1'000;

}  // namespace

absl::StatusOr<std::unique_ptr<NodeChannels>> NodeChannels::Open(Options options) {
  std::unique_ptr<NodeChannels> channels(new NodeChannels(std::move(options)));
  POLYEST_RETURN_IF_ERROR(channels->Reload());
  return channels;
}

absl::Status NodeChannels::Reload() {
  if (options_.ca.empty()) return absl::OkStatus();
  Material material;
  auto ca = ReadFileText(options_.ca);
  if (!ca.ok()) return absl::NotFoundError(absl::StrCat("--node-ca: ", ca.status().message()));
  material.ca = *std::move(ca);
  if (!options_.tls.certificate.empty()) {
    POLYEST_ASSIGN_OR_RETURN(material.own, ReadTlsMaterial(options_.tls));
  }
  const std::lock_guard lock(mutex_);
  material_ = std::move(material);
  channels_.clear();
  return absl::OkStatus();
}

std::shared_ptr<grpc::Channel> NodeChannels::To(const std::string& address) {
  const std::lock_guard lock(mutex_);
  auto& channels = channels_[address];
  for (const auto& channel : channels) {
    if (channel.use_count() <= kMaxReferences) return channel;
  }
  return channels.emplace_back(Connect(address));
}

std::shared_ptr<grpc::Channel> NodeChannels::Connect(const std::string& address) const {
  grpc::ChannelArguments arguments;
  arguments.SetMaxReceiveMessageSize(-1);  // an answer is as large as it is
  arguments.SetInt(GRPC_ARG_ENABLE_HTTP_PROXY, 0);
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);  // each channel has its own connection
  arguments.SetInt(GRPC_ARG_INITIAL_RECONNECT_BACKOFF_MS, kLongestBackoffMs / 4);
  arguments.SetInt(GRPC_ARG_MIN_RECONNECT_BACKOFF_MS, kLongestBackoffMs);
  arguments.SetInt(GRPC_ARG_MAX_RECONNECT_BACKOFF_MS, kLongestBackoffMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIME_MS, kPingMs);
  arguments.SetInt(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kPingTimeoutMs);
  arguments.SetInt(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);  // as many as are due
  const auto credentials =
      options_.ca.empty()
          ? grpc::InsecureChannelCredentials()
          : grpc::SslCredentials({material_.ca, material_.own.key, material_.own.certificate});
  return grpc::CreateCustomChannel(address, credentials, arguments);
}

}  // namespace polyest::internal
