#pragma once

// Finds a bound that a prior of a problem file lacks. To protobuf a number that is not given is 0,
// which would be a bound that nobody has chosen.

#include <absl/strings/string_view.h>

#include <string>

#include "polyest/v1/problem.pb.h"

namespace polyest::internal {

// Returns "uncertain[0].uniform.lower: is missing; …" for the first uniform or beta prior that
// lacks its lower or its upper bound; empty if there is none. `problem` is what the text holds.
std::string FindMissingBound(absl::string_view json, const v1::Problem& problem);

}  // namespace polyest::internal
