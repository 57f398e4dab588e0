#pragma once

#include <absl/status/status.h>
#include <google/protobuf/message.h>

namespace polyest::internal {

// Refuses with INVALID_ARGUMENT, naming the field, a message with more than 10,000 entries in a
// list or a map of texts or messages, at any depth: no problem has as many names, and to look up
// and report each would take long. Lists of numbers may be longer, as tables are.
absl::Status CheckListLengths(const google::protobuf::Message& message);

}  // namespace polyest::internal
