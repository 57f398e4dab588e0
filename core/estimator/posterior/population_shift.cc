#include "core/estimator/posterior/population_shift.h"

#include <cmath>

#include "core/bayes/weighted_samples.h"

namespace polyest::internal {

double PopulationShift(const ResolvedProblem& problem, const PosteriorDraws& posterior) {
  if (!problem.population() || problem.ended_runs() == nullptr) return 0;
  const Matrix shared = posterior.Germs(problem.prior())(Eigen::all, problem.SharedParameters());
  const EndedRuns& ended = *problem.ended_runs();
  return std::hypot(WeightedStandardDeviation(shared * ended.left_out, posterior.weights),
                    std::sqrt(ended.unresolved));
}

}  // namespace polyest::internal
