#pragma once

// The names that a problem file may use, for messages about one that it may not.

#include <absl/strings/string_view.h>

#include <string>

namespace polyest {

// What could be meant by the last name of a path such as "uncertain[0].unifrom", which does not
// exist: "did you mean \"uniform\"?", or, when no name there is near, "there are lower, upper".
// Empty when the path before it does not exist either.
std::string SuggestFieldName(absl::string_view path);

}  // namespace polyest
