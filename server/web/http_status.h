#pragma once

#include <grpcpp/support/status_code_enum.h>

namespace polyest::internal {

// Returns the status of HTTP that stands for a code of gRPC, by the table of google.rpc.Code.
int HttpStatus(grpc::StatusCode code);
// Returns the code of gRPC that tells why a request is refused that is no call: the kind of the
// status of HTTP under which it is refused.
grpc::StatusCode CodeOfRefusal(int http_status);

}  // namespace polyest::internal
