#pragma once

// When to take samples.

#include <absl/status/statusor.h>

#include <vector>

#include "core/common/types.h"
#include "polyest/stop.h"

namespace polyest::internal {

// Which `most` of the times to sample at for the largest expected information gain
// (information_gain.h): one after the other, each the best beside those before (D-optimal, greedy),
// never one twice, and no more when none adds anything. In the order of their choice.
// slopes: for each draw, a_k in rows k·m … k·m + m − 1 for the m outputs sampled together at time
// k. Only a stop request makes it not OK.
absl::StatusOr<std::vector<int>> ChooseSampleTimes(const std::vector<Matrix>& slopes, int m,
                                                   int most, const Stop& stop);

}  // namespace polyest::internal
