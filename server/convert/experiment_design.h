#pragma once

// The request and answer of DesignExperiment.

#include "core/estimator/experiment_design.h"
#include "polyest/v1/estimation_service.pb.h"

namespace polyest {

ExperimentOptions ToExperimentOptions(const v1::DesignExperimentRequest& request);
v1::DesignExperimentResponse::Candidate ToProto(const ExperimentDesign& design);

// The problem's prior, as what is known beforehand.
void AddParameters(const ResolvedProblem& problem, v1::DesignExperimentResponse& response);

}  // namespace polyest
