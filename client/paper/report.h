#pragma once

#include <ostream>

#include "client/paper/experiments.h"

namespace polyest::internal {

// Prints the question, the paper's or the expected result, a table of the estimates of all
// variants, and the details and diagnostics of each variant.
void PrintExperiment(const ExperimentResult& result, std::ostream& out);

}  // namespace polyest::internal
