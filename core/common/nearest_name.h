#pragma once

// Suggests a known name in messages about a name that does not exist.

#include <string>
#include <vector>

namespace polyest::internal {

// Returns the name of `known` that `word` probably misspells: one that differs in case only, in at
// most a third of its letters (inserted, left out, changed or swapped with the next), or of which
// `word` is the beginning. Returns an empty string when no name is that near. The first of equally
// near names wins.
std::string NearestName(const std::string& word, const std::vector<std::string>& known);

// Returns a hint for a message about the unknown name `word`: `did you mean "uniform"?`, or, when
// no name is near, `known names: lower, upper`. Returns an empty string when `known` is empty.
std::string SuggestName(const std::string& word, const std::vector<std::string>& known);

}  // namespace polyest::internal
