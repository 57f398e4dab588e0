#pragma once

#include <string>
#include <vector>

#include "polyest/model.h"

namespace polyest::internal {

// Returns the names in order.
std::vector<std::string> NamesOf(const std::vector<Quantity>& quantities);

// Returns the names in order, comma-separated, to list in a message the names that exist: "m, c, k,
// x0, v0", or "none".
std::string ListNames(const std::vector<Quantity>& quantities);

}  // namespace polyest::internal
