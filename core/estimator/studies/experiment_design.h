#pragma once

// The next experiment, for a resolved problem. information_gain.h has the formulas; the noise of an
// output that the problem does not know is that of assumed_noise.h.

#include <absl/status/statusor.h>

#include "core/estimator/problem/resolved_problem.h"
#include "polyest/experiment_design.h"

namespace polyest::internal {

absl::StatusOr<ExperimentDesign> DesignExperiment(const ResolvedProblem& problem,
                                                  const ExperimentOptions& options,
                                                  const Stop& stop);

// Returns the problem with what an estimate says of its parameters for its prior.
absl::StatusOr<ResolvedProblem> WithEstimateAsPrior(const ResolvedProblem& problem,
                                                    const Estimate& estimate);

}  // namespace polyest::internal
