#pragma once

// Writes problem files to start from. They are valid; their numbers are meant to be edited.

#include <string>

#include "client/cli/proposed_columns.h"
#include "polyest/model.h"

namespace polyest::internal {

// Returns a problem for a model from `source`, "builtin", "fmu" or "umbridge": one or two unknowns
// within 30 % of their defaults, the other parameters fixed at their defaults, a signal for each
// input, and all outputs measured. Infinite defaults are left out, since JSON has no plain number
// for them. With `proposed`, the inputs are streamed and the outputs measured, with noise of
// unknown size, that have columns there; others are left out.
std::string StartingProblem(const ModelDescription& model, const char* source = "builtin",
                            const ProposedColumns* proposed = nullptr);

// A problem whose model, an oscillator, is given by its equations.
extern const char kStartingEquations[];

}  // namespace polyest::internal
