#pragma once

// Whether the units of a model's equations go together.

#include <absl/status/status.h>

#include <map>
#include <string>
#include <vector>

#include "core/model/equations/equation_reader.h"

namespace polyest::internal::equations {

// Appends what does not to `problems`. Returns the unit of each output that has one, as given or
// as its expression has it.
std::map<std::string, std::string> CheckUnits(const EquationSpecification& specification,
                                              const ReadEquations& read,
                                              std::vector<absl::Status>& problems);

}  // namespace polyest::internal::equations
