#pragma once

// Reads an equation specification and makes every check that needs no evaluation.

#include <absl/status/status.h>

#include <map>
#include <string>
#include <vector>

#include "core/model/equations/definitions.h"
#include "core/model/equations/lookup.h"
#include "polyest/equation_model.h"
#include "polyest/model.h"

namespace polyest::internal::equations {

struct ReadEquations {
  std::vector<Definition> states, outputs, intermediates;  // intermediates sorted by dependency
  std::vector<Quantity> parameters;                        // with the initial states last
  std::vector<std::string> inputs;
  std::vector<Lookup> tables;
  std::map<std::string, int> table_index;
};

// Reads the specification and appends its errors to `problems`. The result is usable only if
// nothing was appended.
ReadEquations Read(const EquationSpecification& specification, std::vector<absl::Status>& problems);

// Returns the name of the parameter that holds the state's initial value.
std::string InitialName(const std::string& state);

}  // namespace polyest::internal::equations
