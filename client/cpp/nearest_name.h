#pragma once

// The name that was probably meant, for messages about one that does not exist.

#include <absl/strings/string_view.h>

#include <string>
#include <vector>

namespace polyest::internal {

// Returns the name of `known` that differs from `word` by a slip: in case only, in at most a third
// of its letters (inserted, left out, changed or swapped with the next), or by an ending left out.
// Returns an empty string when no name is that near. The first of equally near names wins.
std::string NearestName(absl::string_view word, const std::vector<std::string>& known);

// Returns what a message may add about `word`: `did you mean "uniform"?`, or, when no name is near,
// `there are lower, upper`. Returns an empty string when nothing is known.
std::string SuggestName(absl::string_view word, const std::vector<std::string>& known);

}  // namespace polyest::internal
