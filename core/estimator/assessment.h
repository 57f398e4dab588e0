#pragma once

// From the sums of an expansion to an estimate: minimum of the cost, curvature, posterior,
// identifiability and what the engineer should be warned of. Its cost does not depend on the
// number of samples.

#include <absl/status/statusor.h>

#include "core/common/stop.h"
#include "core/estimator/estimate.h"
#include "core/estimator/posterior_draws.h"
#include "core/estimator/record_summary.h"
#include "core/estimator/regional_expansion.h"

namespace polyest {

struct AssessmentRequest {
  const ResolvedProblem* problem = nullptr;
  const RegionalExpansion* expansion = nullptr;
  const RecordSummary* record = nullptr;
  const Matrix* guesses = nullptr;  // particles, germ coordinates (may have no rows)
  int reexpansions = 0;
  int64_t propagated_rows = 0;  // trajectories × rows
  PosteriorEffort effort;
};

struct Assessed {
  Estimate estimate;
  PosteriorDraws posterior;  // that it sums up
};

// Only a stop request makes it not OK.
absl::StatusOr<Assessed> Assess(const AssessmentRequest& request, const Stop& stop);

}  // namespace polyest
