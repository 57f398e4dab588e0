#pragma once

#include <absl/status/status.h>

#include "polyest/problem.h"

namespace polyest::internal {

// Checks `regularization` and `regularizationMode`. Returns InvalidArgument that names the field,
// the value and the rule.
absl::Status ValidateRegularization(const Problem& problem);

}  // namespace polyest::internal
