#pragma once

// Problem files to start from: valid as they are, with numbers that are there to be edited.

#include <string>

#include "polyest/model.h"

namespace polyest::internal {

// Returns a problem for a model from `source`, "builtin" or "fmu": one or two unknowns within 30 %
// of their defaults, all else fixed at its default, a signal for each input, every output measured.
// Infinite defaults, which JSON cannot say plainly, are left out.
std::string StartingProblem(const ModelDescription& model, const char* source = "builtin");

// A problem with a model of the user's own as text: an oscillator.
extern const char kStartingEquations[];

}  // namespace polyest::internal
