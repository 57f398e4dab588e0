#pragma once

// The cells of one line of a CSV file.

#include <absl/strings/string_view.h>

#include <cstddef>
#include <string>
#include <vector>

namespace polyest::internal {

// Returns the text without the white space around it, no-break spaces among it.
absl::string_view StripCell(absl::string_view text);

// Returns the cell in quotation marks for a message: the beginning of a long one, control
// characters escaped, in UTF-8.
std::string QuoteCell(absl::string_view cell);

// Returns where the cell that begins at `begin` ends: at the next delimiter or at the end of the
// line. A delimiter within quotes does not count; a quote counts only at the beginning of a cell.
// Returns npos if a quote has no end.
size_t CellEnd(absl::string_view line, size_t begin, char delimiter);

// Returns the text of a cell, in UTF-8, without white space around it and without its quotes;
// doubled quotes within them are one.
std::string CellText(absl::string_view cell);

// Returns the texts of all cells of a line. A quote without an end ends with the line.
std::vector<std::string> SplitCells(absl::string_view line, char delimiter);

}  // namespace polyest::internal
