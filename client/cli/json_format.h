#pragma once

#include <google/protobuf/message.h>

#include <string>

namespace polyest::internal {

// Returns the canonical JSON of a message, fields with their default value included and maps in the
// order of their keys, over several lines or in one; without a line end.
std::string ToJson(const google::protobuf::Message& message, bool several_lines);

}  // namespace polyest::internal
