#pragma once

// Every call of polyest's services passes here once, whatever its kind: it gets its request id, is
// counted when it ends, and leaves a line in the log.

#include <grpcpp/server_builder.h>
#include <grpcpp/server_context.h>

#include <functional>
#include <string>

#include "server/telemetry/metrics.h"

namespace polyest::internal {

// Who calls, for the log; empty for a caller who is not let in.
struct LoggedCaller {
  std::string tenant{};
  std::string name{};  // of the token, or of the client's certificate
};
using CallerOf = std::function<LoggedCaller(const grpc::ServerContextBase&)>;

// Before the server is built; `metrics` outlives the server.
void ObserveCalls(grpc::ServerBuilder& builder, Metrics& metrics, CallerOf caller_of);

}  // namespace polyest::internal
