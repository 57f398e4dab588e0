#pragma once

#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <google/protobuf/message.h>

#include <string>

namespace polyest::internal {

// Returns the canonical JSON of a message in one line or several, without a line end. Fields with
// their default value are included; maps are in the order of their keys.
// The message must be one that this program has made: all its fields have a form in JSON.
std::string ToJson(const google::protobuf::Message& message, bool several_lines);

// Returns the JSON of a message of another program, as ToJson does. INTERNAL if a field has no form
// in JSON, such as a time beyond the year 9999.
absl::StatusOr<std::string> TryToJson(const google::protobuf::Message& message, bool several_lines);

// Reads what ToJson writes into `message`. INVALID_ARGUMENT if the text is not JSON of its type.
absl::Status FromJson(const std::string& json, google::protobuf::Message& message);

}  // namespace polyest::internal
