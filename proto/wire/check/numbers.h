#pragma once

#include <absl/strings/str_format.h>

#include <string>

namespace polyest::internal {

// Returns a number as summaries show it: six significant digits.
inline std::string Number(double value) { return absl::StrFormat("%.6g", value); }

}  // namespace polyest::internal
