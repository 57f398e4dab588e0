#pragma once

// Writes texts into CSV.

#include <absl/strings/string_view.h>

#include <string>

namespace polyest::internal {

// Returns a text as one field of a line of CSV (RFC 4180): in quotation marks if it holds a comma,
// a quotation mark or a line break, as the name K[1,1] of an element does, and as it is otherwise.
std::string CsvField(absl::string_view text);

}  // namespace polyest::internal
