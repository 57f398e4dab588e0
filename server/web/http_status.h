#pragma once

#include <grpcpp/support/status_code_enum.h>

namespace polyest::internal {

// Returns the status of HTTP that stands for a code of gRPC, by the table of google.rpc.Code.
int HttpStatus(grpc::StatusCode code);

}  // namespace polyest::internal
