#pragma once

// Estimates from the beginnings of a record, which show how its estimate came about.

#include <absl/functional/function_ref.h>
#include <absl/status/status.h>

#include "polyest/estimator.h"
#include "polyest/samples.h"
#include "polyest/stop.h"
#include "polyest/v1/estimate.pb.h"

namespace polyest::internal {

// Appends `samples` to the estimator and processes them, and adds `points` ≥ 0 estimates from the
// first rows to the history. The last is of all rows. Their rows grow as the squares of 1, 2, 3, …,
// because estimates change most in the beginning. Rows without any sample processed give none.
absl::Status ProcessWithHistory(Samples samples, int points, Estimator& estimator,
                                v1::EstimateHistory& history, const Stop& stop);

}  // namespace polyest::internal
