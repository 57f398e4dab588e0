#pragma once

// Models whose equations are given as text by somebody who need not be trusted.
//
// The text is read by a parser with limits (limits.h), its expressions are drawn into one graph in
// which common subexpressions are shared, and the graph is evaluated by a register machine for a
// block of points at once. Nothing but arithmetic can be expressed: no loops, no memory, no files.
// The derivatives ∂f/∂x are exact.

#include <string>
#include <vector>

#include "polyest/equation_model.h"

namespace polyest::internal {

// Returns all that is wrong with it, each with its field's path from the problem on:
// "model.equations.states.v: column 7: unknown function \"sine\"; …". Empty: nothing.
std::vector<absl::Status> CheckEquations(const EquationSpecification& specification);

}  // namespace polyest::internal
