#pragma once

// Numbers in summaries.

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <cstdint>
#include <string>

namespace polyest::internal {

// Returns a number as summaries show it: six significant digits.
inline std::string Number(double value) { return absl::StrFormat("%.6g", value); }

// Returns "1 session" or "2 sessions" for "session".
inline std::string Counted(int64_t count, const char* what) {
  return absl::StrCat(count, " ", what, count == 1 ? "" : "s");
}

}  // namespace polyest::internal
