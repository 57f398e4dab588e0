#pragma once

#include <absl/status/status.h>
#include <grpcpp/support/status.h>

#include "polyest/rpc/error_details.pb.h"

namespace polyest::internal {

// Returns the core's status as gRPC's, with its details for programs
// (polyest/rpc/error_details.proto). This is the only place that converts it. A message that would
// not fit into the trailers of a call is cut and ends with "…".
grpc::Status ToGrpc(const absl::Status& status);

// Returns the status as a message: its code, its text, cut likewise, and its details.
rpc::Status ToRpcStatus(const absl::Status& status);

}  // namespace polyest::internal
