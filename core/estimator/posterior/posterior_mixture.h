#pragma once

// Combines the components of the posterior to the estimate of their mixture.

#include <absl/status/statusor.h>

#include <vector>

#include "core/estimator/posterior/assessment.h"
#include "polyest/stop.h"

namespace polyest::internal {

struct AssessedMixture {
  Assessed whole;                    // for a single component, its own assessment
  std::vector<Assessed> components;  // heaviest first; empty for a single component
  std::vector<size_t> order;         // their indices among the requests; {0} for a single one
};

// Assesses the mixture. Takes one request per component, at least one. If a stop has left the
// components at different rows, their last weights are used. `left_out` is that of the last
// weighing. Returns an error only on a stop request.
absl::StatusOr<AssessedMixture> AssessMixture(std::vector<AssessmentRequest> requests,
                                              double left_out, const Stop& stop);

}  // namespace polyest::internal
