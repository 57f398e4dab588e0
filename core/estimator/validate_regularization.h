#pragma once

#include <absl/status/status.h>

#include "core/estimator/problem.h"

namespace polyest {

// Of `regularization` and `regularizationMode`: INVALID_ARGUMENT names the field, the value and the
// rule.
absl::Status ValidateRegularization(const Problem& problem);

}  // namespace polyest
