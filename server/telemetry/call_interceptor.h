#pragma once

// Observes every call of polyest's services once, whatever its kind: gives the call its request id,
// counts it when it ends, and logs it.

#include <grpcpp/server_builder.h>
#include <grpcpp/server_context.h>

#include <functional>
#include <string>

#include "server/telemetry/metrics.h"

namespace polyest::internal {

// Names the caller in the log; empty for a caller who is not let in.
struct LoggedCaller {
  std::string tenant{};
  std::string name{};  // of the token, or of the client's certificate
};
using CallerOf = std::function<LoggedCaller(const grpc::ServerContextBase&)>;

// Makes the server observe its calls. Must be called before the server is built; `metrics` must
// outlive the server.
void ObserveCalls(grpc::ServerBuilder& builder, Metrics& metrics, CallerOf caller_of);

}  // namespace polyest::internal
