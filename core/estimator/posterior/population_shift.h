#pragma once

// The error that estimates have because a population keeps ended runs only approximately
// (expansion/population_of_runs.h).

#include "core/estimator/posterior/posterior_draws.h"
#include "core/estimator/problem/resolved_problem.h"

namespace polyest::internal {

// Returns the largest shift of a mean in standard deviations, ≥ 0; 0 without a population or ended
// runs.
//
// What is left out is linear over the posterior: it shifts every mean by as many standard
// deviations as it has itself, times its correlation with the parameter. An error of the outputs
// shifts by no more than itself in units of the noise.
double PopulationShift(const ResolvedProblem& problem, const PosteriorDraws& posterior);

}  // namespace polyest::internal
