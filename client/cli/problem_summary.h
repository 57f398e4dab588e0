#pragma once

// What a problem asks for, in words.

#include <absl/status/status.h>

#include <ostream>
#include <string>

#include "core/estimator/problem.h"
#include "polyest/v1/problem.pb.h"

namespace polyest {

// "uniform on [3, 5] N/m"; the unit left out for a plain number.
std::string DescribePrior(const v1::UncertainParameter& parameter, const std::string& unit);
// "0.01 m + 1 % of the value + 0.1 % of the largest"
std::string DescribeNoise(const v1::MeasuredOutput::Noise& noise, const std::string& unit);
// "sinusoid of 3 N at 0.5 Hz", "streamed, cubic"
std::string DescribeSignal(const v1::Input& input, const std::string& unit);

// Model, unknowns, inputs, measured outputs and the size of the expansion. An error if the problem,
// though `resolved` from it, has no expansion.
absl::Status PrintProblem(const v1::Problem& problem, const ResolvedProblem& resolved,
                          std::ostream& out);

}  // namespace polyest
