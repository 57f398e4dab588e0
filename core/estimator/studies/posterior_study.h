#pragma once

// The posterior (21)–(23) in full, on the expansion (polyest/posterior.h).

#include <absl/status/status.h>

#include "core/bayes/weighted_samples.h"
#include "core/estimator/posterior/assessment.h"
#include "polyest/posterior.h"

namespace polyest::internal {

// INVALID_ARGUMENT names the field, the value and the rule.
absl::Status Validate(const PosteriorOptions& options, const Prior& prior);
// Returns the work that answers deserve that go into such detail.
PosteriorEffort EffortOf(const PosteriorOptions& options);

// options have been validated.
Posterior DescribePosterior(const Assessed& assessed, const Prior& prior,
                            const PosteriorOptions& options);

}  // namespace polyest::internal
