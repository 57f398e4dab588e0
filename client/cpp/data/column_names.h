#pragma once

// The names in the header of a data file.

#include <absl/strings/string_view.h>

#include <string>

#include "polyest/data_file.h"

namespace polyest::internal {

// A header cell in two parts: "Disp [mm]" has the name "Disp" and the unit "mm".
struct ColumnName {
  std::string header;  // the whole cell
  std::string name;    // the header without its unit
  std::string unit;    // empty: the header has none
};

// Parts a header cell. A unit is in square brackets at its end; in parentheses, after "/" or after
// " in " if it can be read as one. The unit of a time may also be an ending: "t_ms", "time_s".
ColumnName ParseColumnName(absl::string_view header);

// Returns the text of a cell in a row of units without its brackets.
std::string UnitOfCell(absl::string_view cell);

// Whether a name is one of the usual names of a time: t, time, timestamp, Zeit, … in any case, but
// for T, which is a temperature.
bool IsUsualTimeName(absl::string_view name);

// Whether a column is the source of a quantity: the one that its source names, or else the one that
// has its name.
bool IsColumnOf(const ColumnName& column, const std::string& quantity, const DataColumns& columns);

// Whether a column may be the time.
bool MayBeTime(const ColumnName& column, const DataColumns& columns);

}  // namespace polyest::internal
