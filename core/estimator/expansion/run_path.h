#pragma once

// Where the parameters of runs are before and after a run is eliminated (run_elimination.h).

#include <absl/status/status.h>

#include "core/estimator/expansion/germ_summary.h"
#include "core/estimator/problem/ended_runs.h"
#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/learned_noise.h"

namespace polyest::internal {

// Returns the lower triangular factor of a covariance, at least 10⁻⁹ of `unit`.
Matrix SpreadOf(const Matrix& covariance, const Vector& unit);

// Returns the covariance with standard deviations of at most `unit`, and with its correlations.
Matrix NoWiderThan(const Vector& unit, const Matrix& covariance);

// Returns what is known of no ended runs, in terms over `region` of the shared germs, whose
// posterior is `posterior`. The sums will be taken with the scales of `noise`.
EndedRuns WithoutEndedRuns(const ResolvedProblem& problem, Region region,
                           const GermSummary& posterior, const LearnedNoise& noise);

// Sets to 0 how a path follows the mean and the spread of a population, on which outputs do not
// depend: what they say of the run is told apart (population_cost.h).
void FreeOfPopulation(const ResolvedProblem& problem, Matrix& slope);

// Returns the path of run `run` in a posterior of all germs of `problem`, about `centre` of the
// shared ones.
RunPath PathIn(const ResolvedProblem& problem, int run, const GermSummary& posterior,
               const Vector& centre);

// Returns InfeasibleError for a path that is not finite, as where the posterior of what is
// shared has no width.
absl::Status CheckFinite(const RunPath& path, int run);

}  // namespace polyest::internal
