#pragma once

// What a record holds, in words, and what of it deserves a second look.

#include <string>
#include <vector>

#include "core/estimator/problem.h"
#include "core/estimator/sample_checks.h"

namespace polyest {

struct RecordSummary {
  std::string rows;                   // "1000 rows, t from 0.05 to 50 s, every 0.05 s (20 Hz)"
  std::vector<std::string> channels;  // "x: 1000 samples from -1.2 to 0.9 m"
  std::vector<std::string> warnings;
};

// Of a whole record that has passed the checks.
RecordSummary Summarize(const ResolvedProblem& problem, const CheckedSamples& samples);

}  // namespace polyest
