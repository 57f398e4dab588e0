#pragma once

// Designs the next experiment for a resolved problem. The formulas are in information_gain.h; the
// noise of an output is that of assumed_noise.h if the problem does not give it.

#include <absl/status/statusor.h>

#include "core/estimator/problem/resolved_problem.h"
#include "polyest/experiment_design.h"

namespace polyest::internal {

// Does the work of polyest::DesignExperiment (polyest/experiment_design.h) and returns its errors,
// except those of resolving the problem.
absl::StatusOr<ExperimentDesign> DesignExperiment(const ResolvedProblem& problem,
                                                  const ExperimentOptions& options,
                                                  const Stop& stop);

// Returns the problem with the estimate of its parameters as their prior.
absl::StatusOr<ResolvedProblem> WithEstimateAsPrior(const ResolvedProblem& problem,
                                                    const Estimate& estimate);

}  // namespace polyest::internal
