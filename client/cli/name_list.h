#pragma once

// Reads lists of names from options.

#include <absl/strings/string_view.h>

#include <string>
#include <vector>

namespace polyest::internal {

// Returns the names in `list`, which are separated by commas. A comma within brackets is part of a
// name, as in K[1,1] or der(x,2).
std::vector<std::string> SplitNames(absl::string_view list);

}  // namespace polyest::internal
