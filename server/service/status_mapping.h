#pragma once

#include <absl/status/status.h>
#include <grpcpp/support/status.h>

namespace polyest {

// The one place where the core's status becomes gRPC's.
grpc::Status ToGrpc(const absl::Status& status);

}  // namespace polyest
