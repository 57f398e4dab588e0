#pragma once

// Tells problem files from data files by their beginning, so that a message can say that one was
// given for the other.

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <string>

namespace polyest::internal {

enum class FileKind { kUnknown, kJson, kCsv };

// Returns kJson for text that begins with an object or an array, and kCsv for text whose first line
// consists of several cells or is the name of the first column, `t`. Ignores white space and a byte
// order mark at the beginning.
FileKind KindOfText(absl::string_view text);

// Returns the kind of a file by its first 4 KiB; kUnknown if it cannot be read.
FileKind KindOfFile(const std::string& path);

// Refuses a folder with INVALID_ARGUMENT: opening one succeeds, and reading it fails without a
// reason.
absl::Status CheckIsNoFolder(const std::string& path);

}  // namespace polyest::internal
