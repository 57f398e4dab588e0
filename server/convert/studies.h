#pragma once

// Requests and answers of the two studies, Propagate and EvaluateCost.

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

}  // namespace polyest
