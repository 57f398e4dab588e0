#pragma once

// Converts the request and the response of ComputeExperimentDesign.

#include <absl/status/statusor.h>

#include "core/estimator/studies/experiment_design.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

// Returns the options of a request. `step_s` is a hundredth of `until_s` by default.
// INVALID_ARGUMENT for a noise of a possible output that a design cannot use: of unknown size,
// correlated, or with outliers.
absl::StatusOr<ExperimentOptions> ToExperimentOptions(
    const v1::ComputeExperimentDesignRequest& request);
v1::ComputeExperimentDesignResponse::Candidate ToProto(const ExperimentDesign& design);

// Adds the mean and the standard deviation of each parameter under the problem's prior: what is
// known before the experiment.
void AddParameters(const ResolvedProblem& problem, v1::ComputeExperimentDesignResponse& response);

}  // namespace polyest::internal
