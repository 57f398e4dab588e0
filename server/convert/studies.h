#pragma once

// Requests and answers of the studies: Propagate, EvaluateCost and AnalyzeSensitivity.

#include "core/estimator/sensitivity.h"
#include "core/estimator/studies.h"
#include "polyest/v1/estimation_service.pb.h"

namespace polyest {

PropagationOptions ToPropagationOptions(const v1::PropagateRequest& request);
// probabilities: those of the options used.
v1::PropagateResponse ToProto(const Propagation& propagation,
                              const std::vector<double>& probabilities);

CostGridOptions ToCostGridOptions(const v1::EvaluateCostRequest& request);
// The problem has the units of the axes.
v1::EvaluateCostResponse ToProto(const CostGrid& grid, const ResolvedProblem& problem);

SensitivityOptions ToSensitivityOptions(const v1::AnalyzeSensitivityRequest& request);
v1::AnalyzeSensitivityResponse ToProto(const SensitivityAnalysis& analysis);

}  // namespace polyest
