#pragma once

// Describes a problem in words.

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "polyest/v1/problem.pb.h"
#include "polyest/v1/problem_service.pb.h"

namespace polyest::internal {

// Returns a text like "uniform on [3, 5] N/m"; without the unit if it is empty or "1".
std::string DescribePrior(const v1::UncertainParameter& parameter, const std::string& unit);
// Returns a text like "0.01 m + 1 % of the value + 0.1 % of the largest".
std::string DescribeNoise(const v1::MeasuredOutput::Noise& noise, const std::string& unit);
// Returns a text like "sinusoid of 3 N at 0.5 Hz" or "streamed, cubic".
std::string DescribeSignal(const v1::Input& input, const std::string& unit);

using Remarks = std::vector<v1::CheckProblemResponse::Remark>;

// Describes the model, the unknowns, their correlations, derived quantities, inputs, measured
// outputs and the size of the expansion. `resolved` must be made from `problem`. Fails when no
// expansion can be designed for it.
absl::StatusOr<Remarks> SummarizeProblem(const v1::Problem& problem,
                                         const ResolvedProblem& resolved);

}  // namespace polyest::internal
