#pragma once

// Requests and answers of ComputePropagation, ComputeCostGrid and ComputeSensitivity.

#include "core/estimator/studies/cost_grid.h"
#include "core/estimator/studies/prior_propagation.h"
#include "core/estimator/studies/sensitivity.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

PropagationOptions ToPropagationOptions(const v1::ComputePropagationRequest& request);
// probabilities: those of the options used.
v1::ComputePropagationResponse ToProto(const Propagation& propagation,
                                       const std::vector<double>& probabilities);

CostGridOptions ToCostGridOptions(const v1::ComputeCostGridRequest& request);
// The problem has the units of the axes.
v1::ComputeCostGridResponse ToProto(const CostGrid& grid, const ResolvedProblem& problem);

SensitivityOptions ToSensitivityOptions(const v1::ComputeSensitivityRequest& request);
v1::ComputeSensitivityResponse ToProto(const SensitivityAnalysis& analysis);

}  // namespace polyest::internal
