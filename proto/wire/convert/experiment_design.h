#pragma once

// The request and answer of ComputeExperimentDesign.

#include "core/estimator/studies/experiment_design.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

ExperimentOptions ToExperimentOptions(const v1::ComputeExperimentDesignRequest& request);
v1::ComputeExperimentDesignResponse::Candidate ToProto(const ExperimentDesign& design);

// The problem's prior, as what is known beforehand.
void AddParameters(const ResolvedProblem& problem, v1::ComputeExperimentDesignResponse& response);

}  // namespace polyest::internal
