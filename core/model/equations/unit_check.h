#pragma once

// Units of expressions from the units of their names.
//
// The two sides of a sum, a comparison, min, max, mod, atan2, hypot and if must have the same unit,
// scale included; exp, sin and their like take plain numbers and give them; xⁿ needs a constant n
// unless x is plain. A number written out is plain, but 0 has any unit. Where the unit of a name is
// not known nothing that depends on it is checked.

#include <absl/status/statusor.h>

#include <map>
#include <optional>
#include <string>

#include "core/model/equations/parser.h"
#include "core/model/units.h"

namespace polyest::internal::equations {

// The unit of the expression, nullopt if it is not known or is any. `units`: of the names that have
// one. INVALID_ARGUMENT with the column where units do not go together.
absl::StatusOr<std::optional<Unit>> InferUnit(const Syntax& syntax,
                                              const std::map<std::string, Unit>& units);

}  // namespace polyest::internal::equations
