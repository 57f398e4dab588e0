#pragma once

#include <absl/status/status.h>
#include <grpcpp/support/status.h>

#include "polyest/rpc/error_details.pb.h"

namespace polyest::internal {

// The one place where the core's status becomes gRPC's, with what it says to programs
// (polyest/rpc/error_details.proto). A message that would not fit into the trailers of a call is
// cut and ends with "…".
grpc::Status ToGrpc(const absl::Status& status);

// The same as a message: the code, the message and the details.
rpc::Status ToRpcStatus(const absl::Status& status);

}  // namespace polyest::internal
