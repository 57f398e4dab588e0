#pragma once

// Checks the noise that is given for an output.

#include <absl/status/status.h>

#include "core/common/field_error.h"
#include "polyest/problem.h"

namespace polyest::internal {

// Returns InvalidArgument that names the field below `field` whose value is refused, the value and
// the rule. A noise without numbers is none, and passes.
absl::Status ValidateNoise(const FieldPath& field, const NoiseModel& noise);
// Validates the noise of measured output `index` in the same way, and refuses one without numbers.
absl::Status ValidateNoise(int index, const MeasuredOutput& measured);

}  // namespace polyest::internal
