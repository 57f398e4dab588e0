#pragma once

#include <absl/status/statusor.h>

#include <string>

namespace polyest::internal {

// All of a file of at most 16 MiB. NOT_FOUND, naming the file and the reason, when it cannot be
// read.
absl::StatusOr<std::string> ReadFileText(const std::string& file);

}  // namespace polyest::internal
