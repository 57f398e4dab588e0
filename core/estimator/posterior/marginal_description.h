#pragma once

// What an estimate says of one parameter, by the draws or by the prior.

#include <absl/status/status.h>

#include <vector>

#include "core/bayes/prior.h"
#include "core/estimator/posterior/diagnosis.h"
#include "core/estimator/posterior/posterior_draws.h"
#include "polyest/estimate.h"

namespace polyest::internal {

// Sets mean, posterior_std_dev and limits of parameter i.
void DescribeMarginal(const PosteriorDraws& posterior, const Prior& prior, int i,
                      ParameterEstimate& parameter);

// Sets what is known of parameter i to what its prior says: if the data are not used, and if the
// expansion is not accurate and would tell less than the prior, or the curvature tells nothing.
void GoByPriorIfInaccurate(const Findings& findings, const Prior& prior, int i,
                           ParameterEstimate& parameter);

// Returns InfeasibleError that names a parameter whose estimate is not finite, as where ended
// runs have let the posterior go far from the prior.
absl::Status CheckFinite(const std::vector<ParameterEstimate>& parameters);

}  // namespace polyest::internal
