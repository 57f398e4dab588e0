#pragma once

// Checks that the units of a model's equations are consistent.

#include <absl/status/status.h>

#include <map>
#include <string>
#include <vector>

#include "core/model/equations/equation_reader.h"

namespace polyest::internal::equations {

// Appends every inconsistency of units to `problems`. Returns the unit of each output whose unit is
// known, as given or as inferred from its expression.
std::map<std::string, std::string> CheckUnits(const EquationSpecification& specification,
                                              const ReadEquations& read,
                                              std::vector<absl::Status>& problems);

}  // namespace polyest::internal::equations
