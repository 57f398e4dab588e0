#pragma once

// Models whose equations are given as text by somebody who need not be trusted.
//
// The text is read by a parser with limits (limits.h), its expressions are drawn into one graph in
// which common subexpressions are shared, and the graph is evaluated by a register machine for a
// block of points at once. Nothing but arithmetic can be expressed: no loops, no memory, no files.
// The derivatives ∂f/∂x are exact.

#include <absl/status/statusor.h>

#include <memory>
#include <string>
#include <vector>

#include "core/model/equations/equation_specification.h"
#include "core/model/model.h"

namespace polyest {

// All that is wrong with it, each message beginning with the field's path as in a problem file:
// "model.equations.states.v: column 7: unknown function \"sine\"; …". Empty: nothing.
std::vector<std::string> CheckEquations(const EquationSpecification& specification);

// INVALID_ARGUMENT, or RESOURCE_EXHAUSTED past a limit, with the first of these. States, outputs
// and parameters of the model are in alphabetical order, its initial states after the other
// parameters, inputs in the order given.
absl::StatusOr<std::shared_ptr<const StateSpaceModel>> MakeEquationModel(
    const EquationSpecification& specification);

}  // namespace polyest
