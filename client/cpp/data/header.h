#pragma once

// Finds the header of a data file and its delimiter.

#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <vector>

#include "client/cpp/data/column_names.h"
#include "client/cpp/data/text_lines.h"
#include "polyest/data_file.h"

namespace polyest::internal {

struct Header {
  char delimiter = ',';
  std::vector<ColumnName> names;
  int64_t line = 0;
  int lines_above = 0;      // lines that are neither blank nor comments, and are left out
  bool in_comment = false;  // whether it is a comment, as numpy.savetxt writes it
  bool windows = false;     // whether it is in Windows-1252
};

// Whether a line is left out: a blank one or a comment.
bool IsLeftOut(absl::string_view line);

// Reads up to the header: the first line that names the time and a quantity of `columns`. Without
// one, it is the first line that names the time, or else the first line, so that a message can say
// what is missing there. The search ends at the first line of numbers. INVALID_ARGUMENT for text
// without any line and for what is not text.
absl::StatusOr<Header> FindHeader(TextLines& lines, const DataColumns& columns);

}  // namespace polyest::internal
