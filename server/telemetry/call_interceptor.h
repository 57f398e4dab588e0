#pragma once

// Every call of polyest's services passes here once, whatever its kind: it gets its request id, is
// counted when it ends, and leaves a line in the log.

#include <grpcpp/server_builder.h>
#include <grpcpp/server_context.h>

#include <functional>
#include <string>

#include "server/telemetry/metrics.h"

namespace polyest {

// The tenant who calls, for the log; empty for a caller who is not let in.
using TenantOf = std::function<std::string(const grpc::ServerContextBase&)>;

// Before the server is built; `metrics` outlives the server.
void ObserveCalls(grpc::ServerBuilder& builder, Metrics& metrics, TenantOf tenant_of);

}  // namespace polyest
