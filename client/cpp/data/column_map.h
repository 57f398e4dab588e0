#pragma once

// Finds out which columns of a data file are which quantities.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "client/cpp/data/column_names.h"
#include "client/cpp/data/header.h"
#include "client/cpp/data/text_lines.h"
#include "core/model/unit_conversion.h"
#include "polyest/data_file.h"

namespace polyest::internal {

struct DataColumn {
  enum Role {
    kIgnored,
    kTime,
    kRun,
    kMeasured,
    kStreamed,
    kRefused,  // its error has been reported
  };

  ColumnName name;
  Role role = kIgnored;
  std::string quantity = {};  // empty: none
  // Set by ResolveUnits: the unit of the column and the model's, each empty if it is not known, and
  // the conversion from one to the other.
  std::string unit = {};
  std::string model_unit = {};
  UnitConversion conversion = {};
  // For the time: why its unit cannot be used; empty if it can. Dates need no unit.
  std::string unit_refusal = {};

  bool is_channel() const { return role == kMeasured || role == kStreamed; }
};

// Returns the columns of a file by its header. `lines` names the file in messages. Refusals that
// leave rows to be read go to `refused`. INVALID_ARGUMENT otherwise: the time is not known, or no
// measured output has a column.
absl::StatusOr<std::vector<DataColumn>> MapColumns(const Header& header, const DataColumns& known,
                                                   const TextLines& lines, RefusedLine refused);

// Returns how messages call a column: `x`, or `"Disp [mm]" (x)` if its header is not its quantity.
std::string ColumnLabel(const DataColumn& column);

}  // namespace polyest::internal
