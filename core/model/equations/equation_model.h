#pragma once

// Models whose equations are given as text, possibly by an untrusted user.
//
// A parser with limits (limits.h) reads the text. All expressions become one graph, in which common
// subexpressions are shared. A register machine evaluates the graph for a block of points at once.
// Only arithmetic can be expressed: no loops, no memory, no files. The state Jacobian ∂f/∂x is
// exact (symbolic).

#include <string>
#include <vector>

#include "polyest/equation_model.h"

namespace polyest::internal {

// Returns every error in the specification, each with its field's path starting at the problem:
// "model.equations.states.v: column 7: unknown function \"sine\"; …". An empty list means that the
// specification is valid.
std::vector<absl::Status> CheckEquations(const EquationSpecification& specification);

}  // namespace polyest::internal
