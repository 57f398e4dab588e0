#pragma once

#include <absl/status/status.h>
#include <google/protobuf/message.h>

#include <string>

namespace polyest::internal {

// Returns the canonical JSON of a message in one line or several, without a line end. Fields with
// their default value are included; maps are in the order of their keys.
std::string ToJson(const google::protobuf::Message& message, bool several_lines);

// Reads what ToJson writes into `message`. INVALID_ARGUMENT if the text is not JSON of its type.
absl::Status FromJson(const std::string& json, google::protobuf::Message& message);

}  // namespace polyest::internal
