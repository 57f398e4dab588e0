#pragma once

#include <absl/status/status.h>

#include "polyest/problem.h"

namespace polyest::internal {

// Of `regularization` and `regularizationMode`: INVALID_ARGUMENT names the field, the value and the
// rule.
absl::Status ValidateRegularization(const Problem& problem);

}  // namespace polyest::internal
