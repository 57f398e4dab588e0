// The studies as users call them: each resolves the problem and runs the study.

#include "core/common/status.h"
#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/studies/cost_grid.h"
#include "core/estimator/studies/experiment_design.h"
#include "core/estimator/studies/prior_propagation.h"
#include "core/estimator/studies/sensitivity.h"

namespace polyest {

using namespace internal;

absl::StatusOr<Propagation> PropagatePrior(const Problem& problem,
                                           const PropagationOptions& options, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const ResolvedProblem resolved, ResolvedProblem::Make(problem));
  return PropagatePrior(resolved, options, stop);
}

absl::StatusOr<CostGrid> EvaluateCostGrid(const Problem& problem, const Samples& samples,
                                          const CostGridOptions& options, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const ResolvedProblem resolved, ResolvedProblem::Make(problem));
  return EvaluateCostGrid(resolved, samples, options, stop);
}

absl::StatusOr<SensitivityAnalysis> AnalyzeSensitivity(const Problem& problem,
                                                       const SensitivityOptions& options,
                                                       const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const ResolvedProblem resolved, ResolvedProblem::Make(problem));
  return AnalyzeSensitivity(resolved, options, stop);
}

absl::StatusOr<ExperimentDesign> DesignExperiment(const Problem& problem,
                                                  const ExperimentOptions& options,
                                                  const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const ResolvedProblem resolved, ResolvedProblem::Make(problem));
  return DesignExperiment(resolved, options, stop);
}

absl::StatusOr<Problem> WithEstimateAsPrior(const Problem& problem, const Estimate& estimate) {
  POLYEST_ASSIGN_OR_RETURN(const ResolvedProblem resolved, ResolvedProblem::Make(problem));
  const auto n = static_cast<Eigen::Index>(problem.uncertain.size());
  if (estimate.parameters.size() < problem.uncertain.size() || estimate.covariance.rows() < n ||
      estimate.covariance.cols() < n) {
    return absl::InvalidArgumentError("the estimate has fewer parameters than the problem");
  }
  POLYEST_ASSIGN_OR_RETURN(const ResolvedProblem next, WithEstimateAsPrior(resolved, estimate));
  return next.problem();
}

}  // namespace polyest
