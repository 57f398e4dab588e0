#pragma once

// Chooses the times at which to take samples.

#include <absl/status/statusor.h>

#include <vector>

#include "core/common/types.h"
#include "polyest/stop.h"

namespace polyest::internal {

// Returns up to `most` times for the largest expected information gain (information_gain.h), in the
// order of their choice. They are chosen one after the other, each as the best in addition to those
// before (D-optimal, greedy). No time is chosen twice, and the choice ends when no further time
// adds information. `slopes` holds for each draw a_k in rows k·m … k·m + m − 1, for the m outputs
// sampled together at time k. Returns an error only on a stop request.
absl::StatusOr<std::vector<int>> ChooseSampleTimes(const std::vector<Matrix>& slopes, int m,
                                                   int most, const Stop& stop);

}  // namespace polyest::internal
