#pragma once

// Infers the unit of an expression from the units of its names and checks it for consistency.
//
// The two sides of a sum, a comparison, min, max, mod, atan2, hypot and if must have the same unit,
// scale included. exp, sin and similar functions take plain numbers and return plain numbers. xⁿ
// needs a constant n unless x is plain. A literal number is plain, except that 0 has any unit.
// Anything that depends on a name of unknown unit is not checked.

#include <absl/status/statusor.h>

#include <map>
#include <optional>
#include <string>

#include "core/model/equations/parser.h"
#include "core/model/units.h"

namespace polyest::internal::equations {

// Returns the unit of the expression, or nullopt if it is unknown or arbitrary. `units` holds the
// names whose unit is known. Returns InvalidArgument with the column where units are inconsistent.
absl::StatusOr<std::optional<Unit>> InferUnit(const Syntax& syntax,
                                              const std::map<std::string, Unit>& units);

}  // namespace polyest::internal::equations
