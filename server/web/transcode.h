#pragma once

// Turns JSON into serialized requests, and serialized responses and errors into JSON.

#include <absl/status/statusor.h>
#include <google/protobuf/descriptor.h>
#include <grpcpp/support/status.h>

#include <string>

#include "polyest/rpc/error_details.pb.h"

namespace polyest::internal {

// Reads the JSON of a message of this type into `bytes`, serialized; an empty text is {}. Returns
// OK, or INVALID_ARGUMENT that names the line or the field.
rpc::Status FromJsonText(const std::string& json, const google::protobuf::Descriptor& type,
                         std::string& bytes);

// Returns the JSON of a serialized message of this type in one line, as `polyest --format json`
// writes it. INTERNAL, which the log explains, if it has none.
absl::StatusOr<std::string> ToJsonText(const std::string& bytes,
                                       const google::protobuf::Descriptor& type);

// Returns a status of gRPC with the details that it carries.
rpc::Status ToRpcStatus(const grpc::Status& status);

}  // namespace polyest::internal
