#pragma once

// Checks the noise that a problem gives for a measured output.

#include <absl/status/status.h>

#include "polyest/problem.h"

namespace polyest::internal {

// Returns InvalidArgument that names the field of measured output `index` whose value is refused,
// the value and the rule.
absl::Status ValidateNoise(int index, const MeasuredOutput& measured);

}  // namespace polyest::internal
