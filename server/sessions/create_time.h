#pragma once

// Checks the times at which sessions were created. Messages may carry those from the year 1 to
// 9999, which have a form in JSON; journals of earlier versions may hold others, from imported
// files.

#include <google/protobuf/timestamp.pb.h>

namespace polyest::internal {

// Returns whether the time has a form in JSON.
bool HasJsonForm(const google::protobuf::Timestamp& time);

// Returns the time nearest to `time` that has a form in JSON.
google::protobuf::Timestamp NearestWithJsonForm(google::protobuf::Timestamp time);

}  // namespace polyest::internal
