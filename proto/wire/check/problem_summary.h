#pragma once

// Says in words what a problem asks for.

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "polyest/v1/problem.pb.h"
#include "polyest/v1/problem_service.pb.h"

namespace polyest::internal {

// Returns "uniform on [3, 5] N/m"; the unit left out for a plain number.
std::string DescribePrior(const v1::UncertainParameter& parameter, const std::string& unit);
// Returns "0.01 m + 1 % of the value + 0.1 % of the largest"
std::string DescribeNoise(const v1::MeasuredOutput::Noise& noise, const std::string& unit);
// Returns "sinusoid of 3 N at 0.5 Hz", "streamed, cubic"
std::string DescribeSignal(const v1::Input& input, const std::string& unit);

using Remarks = std::vector<v1::CheckProblemResponse::Remark>;

// Describes model, unknowns, inputs, measured outputs and the size of the expansion. An error if
// the problem, though `resolved` from it, has no expansion.
absl::StatusOr<Remarks> SummarizeProblem(const v1::Problem& problem,
                                         const ResolvedProblem& resolved);

}  // namespace polyest::internal
