#pragma once

// Finds the units of the columns of a data file and how they become the model's.

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <string>
#include <vector>

#include "client/cpp/data/column_map.h"
#include "client/cpp/data/text_lines.h"
#include "polyest/data_file.h"

namespace polyest::internal {

// Whether the cells of the line below the header are units: at least one is, and none is a number
// or a time. (The 1 of a plain number is no number here, unless it is the time's.)
bool IsUnitsRow(const std::vector<std::string>& cells, const std::vector<DataColumn>& columns);

// Sets the units and conversions of all used columns. `unit_cells` is the row of units, empty if
// the file has none. A column whose unit cannot be read or converted becomes kRefused, and
// `refused` gets the error, as one of the line `line`. For the time, it is kept in `unit_refusal`.
absl::Status ResolveUnits(const DataColumns& known, const std::vector<std::string>& unit_cells,
                          int64_t line, const TextLines& lines, RefusedLine refused,
                          std::vector<DataColumn>& columns);

}  // namespace polyest::internal
