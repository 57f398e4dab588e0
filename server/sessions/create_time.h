#pragma once

// When a session was created, as its messages may say: from the year 1 to 9999, the times that have
// a form in JSON. Journals of earlier versions may hold others, from imported files.

#include <google/protobuf/timestamp.pb.h>

namespace polyest::internal {

// Returns whether the time has a form in JSON.
bool HasJsonForm(const google::protobuf::Timestamp& time);

// Returns the time nearest to `time` that has a form in JSON.
google::protobuf::Timestamp NearestWithJsonForm(google::protobuf::Timestamp time);

}  // namespace polyest::internal
