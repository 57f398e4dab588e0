#pragma once

// The full posterior, equations (21) to (23), on the expansion (polyest/posterior.h).

#include <absl/status/status.h>

#include "core/bayes/weighted_samples.h"
#include "core/estimator/posterior/assessment.h"
#include "polyest/posterior.h"

namespace polyest::internal {

// Returns InvalidArgument that names the field, the value and the rule if the options are invalid.
absl::Status Validate(const PosteriorOptions& options, const Prior& prior);
// Returns the computing effort for results in the detail that the options request.
PosteriorEffort EffortOf(const PosteriorOptions& options);

// Describes the posterior. `options` must be valid.
Posterior DescribePosterior(const Assessed& assessed, const Prior& prior,
                            const PosteriorOptions& options);

}  // namespace polyest::internal
