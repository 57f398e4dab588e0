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

// Calls a parameter WEAK, not IDENTIFIED, if the posterior in all its pieces is too wide for that,
// however narrow the piece at the minimum is.
void DoubtIfPiecesSpread(ParameterEstimate& parameter);

// Replaces the standard deviation of parameter i, with its row and column of the covariance.
void ReplaceDeviation(int i, double std_dev, Estimate& estimate);

// Sets what is known of the parameters to what the prior says, with covariance and directions: of
// all of them if the data are not used; of a parameter of which an inaccurate expansion would tell
// less than the prior, or the curvature nothing.
void GoByPriorIfInaccurate(const Findings& findings, const Prior& prior, Estimate& estimate);

// Returns InfeasibleError that names a parameter whose estimate is not finite, as where ended
// runs have let the posterior go far from the prior.
absl::Status CheckFinite(const std::vector<ParameterEstimate>& parameters);

}  // namespace polyest::internal
