#pragma once

// Checks where a problem says that data files have its quantities.

#include <absl/status/status.h>

#include <vector>

#include "polyest/model.h"
#include "polyest/v1/problem.pb.h"

namespace polyest::internal {

// Returns the errors of `columns`: a key that is no measured output, streamed input, `t` or `run`,
// an entry without a field, and a unit that cannot be read or converted to the model's. `model` is
// null if it is not known; its units are not checked then.
std::vector<absl::Status> CheckColumns(const v1::Problem& problem, const Model* model);

}  // namespace polyest::internal
