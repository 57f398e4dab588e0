#pragma once

// The population that parameters of runs share: as a term of the cost, and what it is told of a run
// that has ended.

#include <memory>

#include "core/bayes/cost.h"
#include "core/bayes/population_cost.h"
#include "core/bayes/score_likelihood.h"
#include "core/estimator/expansion/run_marginal.h"
#include "core/estimator/problem/resolved_problem.h"

namespace polyest::internal {

// Returns the term for the runs that have ended and those with parameters in `problem`, which must
// have a population.
std::shared_ptr<const PopulationCost> PopulationCostOf(const ResolvedProblem& problem);

// Returns the likelihood of the run's score, without its other own parameters, which are integrated
// out, on the region of `cost`. The first local coordinates of that are those of the shared germs,
// at `eta_shared`; `minimum` is the minimum over the own ones there. The run is the last of
// `problem`.
ScoreLikelihood ScoreLikelihoodOf(const ResolvedProblem& problem, const Cost& cost,
                                  const Vector& eta_shared, const ConditionalMinimum& minimum);

// Moves the score's mean and variance in a run's path; its other parameters follow by regression.
void SetScore(const ResolvedProblem& problem, const RunScore& score, RunPath& path);

// Appends the shape of a run's posterior to `ended`, and adds the slope of what the cost of the
// shared germs leaves out of the run, by differences over one standard deviation of their
// posterior: the run's −log ∫ L(g) N(g; μ, s²) dg, less that in N(0, 1), which the remainder of the
// ended runs has, and less what the population is told. `cost` is the run's own, `score` its
// likelihood at the centre of the region of `ended`, and `path` the one found.
void TellPopulation(const ResolvedProblem& problem, const Cost& cost, const RunPath& path,
                    const ScoreLikelihood& score, EndedRuns& ended);

}  // namespace polyest::internal
