#pragma once

// Reads a specification: every check of it that needs no evaluation.

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
  std::vector<Definition> states, outputs, intermediates;  // intermediates by dependency
  std::vector<Quantity> parameters;                        // initial states last
  std::vector<std::string> inputs;
  std::vector<Lookup> tables;
  std::map<std::string, int> table_index;
};

// What is wrong is appended to `problems`; the result is of use only if nothing was.
ReadEquations Read(const EquationSpecification& specification, std::vector<absl::Status>& problems);

// The name of the parameter that is the state's initial value.
std::string InitialName(const std::string& state);

}  // namespace polyest::internal::equations
