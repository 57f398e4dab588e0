#pragma once

// Prior–data conflict: whether what the data say of the parameters is improbable by their prior
// (Evans and Moshonov, Bayesian Analysis 1 (2006) 893). The posterior is a compromise between the
// two then, and one of them is wrong.

#include "core/common/types.h"
#include "core/estimator/posterior/posterior_draws.h"
#include "core/estimator/problem/resolved_problem.h"

namespace polyest::internal {

// Conflicts in standard deviations: one of 4 is as improbable as a standard normal variable beyond
// ±4.
struct PriorConflict {
  Vector of_parameters;  // by parameter, on its own
  double of_all = 0;     // of all parameters together
};

// With the standard normal prior of g, a normal posterior of mean ĝ and standard deviation s, and
// data that come from the prior, ĝ is distributed as N(0, 1 − s²); the conflict of g is |ĝ|/√(1 −
// s²). In place of ĝ²/2, other priors have the logarithm of their density's maximum relative to
// that at ĝ, which for a uniform one is 0. All parameters together are compared with χ² of their
// number, without the factor 1 − s². The runs' own parameters of a population count as 0.
// `regularization` is α².
PriorConflict FindPriorConflict(const ResolvedProblem& problem, const PosteriorDraws& posterior,
                                double regularization);

}  // namespace polyest::internal
