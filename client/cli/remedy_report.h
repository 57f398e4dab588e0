#pragma once

// Prints which remedies have been tried and what the record says of them.

#include <ostream>

#include "client/cli/remedy_trial.h"

namespace polyest::internal {

// Prints the table of the remedies, a verdict and what to write into the problem file.
void PrintTrial(const RemedyTrial& trial, std::ostream& out);

}  // namespace polyest::internal
