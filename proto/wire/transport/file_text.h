#pragma once

#include <absl/status/statusor.h>

#include <string>

namespace polyest::internal {

// Returns the content of a file. NOT_FOUND, naming the file and the reason, when it cannot be read
// or is longer than 16 MiB.
absl::StatusOr<std::string> ReadFileText(const std::string& file);

}  // namespace polyest::internal
