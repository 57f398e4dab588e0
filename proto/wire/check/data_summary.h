#pragma once

// Summarizes a record of measurements in words and warns of suspicious data.

#include <string>
#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/sample_checks.h"

namespace polyest::internal {

struct DataSummary {
  std::string rows;                   // "1000 rows, t from 0.05 to 50 s, every 0.05 s (20 Hz)"
  std::vector<std::string> channels;  // "x: 1000 samples from -1.2 to 0.9 m"
  std::vector<std::string> warnings;
};

// Summarizes a whole record that has passed the checks.
DataSummary Summarize(const ResolvedProblem& problem, const CheckedSamples& samples);

}  // namespace polyest::internal
