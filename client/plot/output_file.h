#pragma once

// Writes files that users ask for by an option. What they hold may take long to compute, so that a
// file which cannot be written should be known before.

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <string>

namespace polyest::internal {

// Returns OK if `file` may be written to, or if its folder is there and may take it; changes
// nothing. Otherwise UNKNOWN with the option, such as "--plot", the file and the reason.
absl::Status CheckOutputFile(absl::string_view option, const std::string& file);

// Replaces the whole file, or leaves it as it is (draft_file.h). Fails as CheckOutputFile.
absl::Status WriteOutputFile(absl::string_view option, const std::string& file,
                             absl::string_view text);

}  // namespace polyest::internal
