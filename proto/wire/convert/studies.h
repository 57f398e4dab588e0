#pragma once

// Converts the requests and the responses of ComputePropagation, ComputeCostGrid and
// ComputeSensitivity.

#include "core/estimator/studies/cost_grid.h"
#include "core/estimator/studies/prior_propagation.h"
#include "core/estimator/studies/sensitivity.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

PropagationOptions ToPropagationOptions(const v1::ComputePropagationRequest& request);
// Converts a propagation that was computed with quantiles at these probabilities.
v1::ComputePropagationResponse ToProto(const Propagation& propagation,
                                       const std::vector<double>& probabilities);

CostGridOptions ToCostGridOptions(const v1::ComputeCostGridRequest& request);
// Converts a cost grid. The units of its axes are taken from `problem`.
v1::ComputeCostGridResponse ToProto(const CostGrid& grid);

// Returns the options of a request. `step_s` is a hundredth of `until_s` by default.
SensitivityOptions ToSensitivityOptions(const v1::ComputeSensitivityRequest& request);
v1::ComputeSensitivityResponse ToProto(const SensitivityAnalysis& analysis);

}  // namespace polyest::internal
