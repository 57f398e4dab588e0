#pragma once

#include <ostream>

#include "client/paper/experiments.h"

namespace polyest::internal {

// Prints what was asked, a table of what the estimator answers for each variant, what it remarks,
// and beside it what the paper says.
void PrintExperiment(const ExperimentResult& result, std::ostream& out);

}  // namespace polyest::internal
