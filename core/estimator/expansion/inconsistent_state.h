#pragma once

#include <absl/status/status.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/string_view.h>

namespace polyest::internal {

// Returns DataLoss: a part of a snapshot's state cannot be that of the problem.
inline absl::Status InconsistentState(absl::string_view what) {
  return absl::DataLossError(absl::StrCat("the snapshot's ", what, " cannot be of this problem"));
}

}  // namespace polyest::internal
