#include "server/daemon/grpc_settings.h"

#include <absl/synchronization/mutex.h>
#include <grpcpp/ext/proto_server_reflection_plugin.h>
#include <grpcpp/health_check_service_interface.h>
#include <grpcpp/resource_quota.h>

#include <cstddef>

namespace polyest::internal {
namespace {

// Clients ping every 20 s, also while no call is open, and other daemons every 2 s.
constexpr int kShortestPingIntervalMs = 1'000;
constexpr int kKeepaliveTimeMs = 60'000;
constexpr int kKeepaliveTimeoutMs = 20'000;
// Largest number of streams of one connection.
constexpr int kMaxConcurrentStreams = 1'000;
// Longest time until a new connection has ended its handshakes, TLS's and HTTP/2's.
constexpr int kHandshakeTimeoutMs = 20'000;

}  // namespace

void PrepareGrpc() {
  grpc::EnableDefaultHealthCheckService(true);
  grpc::reflection::InitProtoReflectionServerBuilderPlugin();
  // Debian's Abseil looks for cycles in the order of gRPC's mutexes, which takes a tenth of the
  // time of a stream of small batches.
  absl::SetMutexDeadlockDetectionMode(absl::OnDeadlockCycle::kIgnore);
}

void LimitClients(grpc::ServerBuilder& builder, int max_message_mb, int64_t buffer_bytes) {
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, kHandshakeTimeoutMs);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, kMaxConcurrentStreams);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kKeepaliveTimeMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kKeepaliveTimeoutMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS,
                             kShortestPingIntervalMs);
  builder.SetMaxReceiveMessageSize(max_message_mb * 1024 * 1024);
  builder.SetResourceQuota(
      grpc::ResourceQuota("polyestd").Resize(static_cast<size_t>(buffer_bytes)));
}

}  // namespace polyest::internal
