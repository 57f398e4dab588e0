#pragma once

// Observes every call of polyest's services once, whatever its kind: gives the call its request id,
// counts it when it ends, and logs it.

#include <grpcpp/server_builder.h>
#include <grpcpp/server_context.h>

#include <functional>
#include <string>

#include "server/telemetry/audit_log.h"
#include "server/telemetry/metrics.h"

namespace polyest::internal {

// Names the caller in the log; empty for a caller who is not let in.
struct LoggedCaller {
  std::string tenant{};
  std::string name{};  // of the token, or of the client's certificate
  std::string role{};
  std::string peer{};  // also where it is not let in
};
using CallerOf = std::function<LoggedCaller(const grpc::ServerContextBase&)>;

// Makes the server observe its calls. Must be called before the server is built; `metrics` and
// `audit`, which may be null, must outlive the server. The audit log gets the calls that create,
// delete, import or export sessions or back them up, and those of callers who are not let in.
void ObserveCalls(grpc::ServerBuilder& builder, Metrics& metrics, AuditLog* audit,
                  CallerOf caller_of);

}  // namespace polyest::internal
