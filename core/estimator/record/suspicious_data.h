#pragma once

// Warns of data that are allowed but probably not what was meant. `polyest check` gives these
// warnings before anything is computed, and estimates have them as SUSPICIOUS_DATA.

#include <string>
#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/data_facts.h"

namespace polyest::internal {

// Returns the warnings, each in one sentence with its remedy; none before the first row. The facts
// must be of a record of this problem.
std::vector<std::string> WarnOfSuspiciousData(const ResolvedProblem& problem,
                                              const DataFacts& facts);

}  // namespace polyest::internal
