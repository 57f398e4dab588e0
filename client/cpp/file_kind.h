#pragma once

// Tells a problem file from a data file by how it begins, so that one given for the other is named
// as such.

#include <absl/strings/string_view.h>

#include <string>

namespace polyest::internal {

enum class FileKind { kUnknown, kJson, kCsv };

// Returns kJson for text that begins with an object or an array, and kCsv for text whose first line
// is several cells or the name of the first column, `t`. Blank space and a byte order mark before
// it do not count.
FileKind KindOfText(absl::string_view text);

// Returns the kind of a file; kUnknown for one that cannot be read.
FileKind KindOfFile(const std::string& path);

}  // namespace polyest::internal
