#include "client/cli/proposed_columns.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <set>
#include <utility>

#include "client/cpp/data/cells.h"
#include "client/cpp/data/column_map.h"
#include "client/cpp/data/column_units.h"
#include "client/cpp/data/header.h"
#include "client/cpp/data/text_lines.h"
#include "client/cpp/file_kind.h"
#include "core/common/status.h"
#include "core/model/unit_conversion.h"

namespace polyest::internal {
namespace {

// Returns the inputs and outputs of a model.
std::vector<Quantity> RecordedQuantities(const ModelDescription& model) {
  std::vector<Quantity> quantities = model.outputs;
  quantities.insert(quantities.end(), model.inputs.begin(), model.inputs.end());
  return quantities;
}

// Returns the units in the line below the header; none if it is not a row of units.
absl::StatusOr<std::vector<std::string>> ReadUnits(TextLines& lines, char delimiter,
                                                   const std::vector<DataColumn>& columns) {
  absl::string_view line;
  do {
    POLYEST_ASSIGN_OR_RETURN(const bool found, lines.Next(line));
    if (!found) return std::vector<std::string>();
  } while (IsLeftOut(line));
  std::vector<std::string> cells = SplitCells(line, delimiter);
  if (!IsUnitsRow(cells, columns)) cells.clear();
  return cells;
}

bool Converts(const ColumnName& column, const Quantity& quantity) {
  return !column.unit.empty() && !quantity.unit.empty() &&
         ConvertUnit(column.unit, quantity.unit).ok();
}

// Adds the columns whose names are those of quantities.
void ProposeByName(const std::vector<Quantity>& quantities, const RecordedColumns& recorded,
                   ProposedColumns& proposed) {
  for (const Quantity& quantity : quantities) {
    for (const ColumnName& column : recorded.names) {
      if (column.header != quantity.name && column.name != quantity.name) continue;
      proposed.headers.emplace(quantity.name, column.header);
    }
  }
}

// Adds the columns whose units leave one quantity only.
void ProposeByUnit(const std::vector<Quantity>& quantities, const RecordedColumns& recorded,
                   ProposedColumns& proposed) {
  std::set<std::string> used;
  for (const auto& [quantity, header] : proposed.headers) used.insert(header);
  ProposedColumns further;
  for (const Quantity& quantity : quantities) {
    if (proposed.headers.contains(quantity.name)) continue;
    std::vector<std::string> columns;
    for (const ColumnName& column : recorded.names) {
      if (!used.contains(column.header) && Converts(column, quantity)) {
        columns.push_back(column.header);
      }
    }
    const auto rivals = std::count_if(quantities.begin(), quantities.end(), [&](const auto& other) {
      return !proposed.headers.contains(other.name) && !quantity.unit.empty() &&
             ConvertUnit(quantity.unit, other.unit).ok();
    });
    if (columns.size() == 1 && rivals == 1) further.headers[quantity.name] = columns.front();
  }
  proposed.headers.merge(further.headers);
}

}  // namespace

absl::StatusOr<RecordedColumns> ReadColumns(const std::string& file,
                                            const DataFileOptions& options) {
  POLYEST_RETURN_IF_ERROR(CheckIsNoFolder(file));
  std::ifstream in(file, std::ios::binary);
  if (!in) {
    return absl::InvalidArgumentError(
        absl::StrCat(file, ": cannot be opened: ", std::strerror(errno)));
  }
  DataColumns known;
  known.options = options;
  TextLines lines(in, file);
  POLYEST_ASSIGN_OR_RETURN(const Header header, FindHeader(lines, known));
  POLYEST_ASSIGN_OR_RETURN(const std::vector<DataColumn> columns,
                           MapColumns(header, known, lines, StopAtRefusedLine));
  POLYEST_ASSIGN_OR_RETURN(const std::vector<std::string> units,
                           ReadUnits(lines, header.delimiter, columns));
  RecordedColumns recorded;
  for (size_t i = 0; i < columns.size(); ++i) {
    ColumnName name = columns[i].name;
    if (name.unit.empty() && i < units.size()) name.unit = UnitOfCell(units[i]);
    if (columns[i].role == DataColumn::kTime) {
      recorded.time = name.header;
    } else if (columns[i].role == DataColumn::kIgnored && !name.header.empty()) {
      recorded.names.push_back(std::move(name));
    }
  }
  return recorded;
}

ProposedColumns ProposeColumns(const ModelDescription& model, const RecordedColumns& recorded) {
  const std::vector<Quantity> quantities = RecordedQuantities(model);
  ProposedColumns proposed;
  ProposeByName(quantities, recorded, proposed);
  ProposeByUnit(quantities, recorded, proposed);
  if (!IsUsualTimeName(ParseColumnName(recorded.time).name)) {
    proposed.headers["t"] = recorded.time;
  }
  return proposed;
}

absl::Status CheckProposal(const ModelDescription& model, const RecordedColumns& recorded,
                           const ProposedColumns& proposed, const std::string& file) {
  std::vector<std::string> outputs;
  for (const Quantity& output : model.outputs) {
    if (proposed.headers.contains(output.name)) return absl::OkStatus();
    outputs.push_back(absl::StrCat(output.name, " [", output.unit, "]"));
  }
  std::vector<std::string> headers;
  for (const ColumnName& column : recorded.names) headers.push_back(QuoteCell(column.header));
  return absl::InvalidArgumentError(absl::StrCat(
      file, ": no column fits an output of ", model.name, "; its outputs are ",
      absl::StrJoin(outputs, ", "), ", and the columns are ", absl::StrJoin(headers, ", ")));
}

std::string Describe(const RecordedColumns& recorded, const ProposedColumns& proposed) {
  std::vector<std::string> used, unused;
  for (const ColumnName& column : recorded.names) {
    const auto taken =
        std::find_if(proposed.headers.begin(), proposed.headers.end(),
                     [&](const auto& entry) { return entry.second == column.header; });
    if (taken == proposed.headers.end()) {
      unused.push_back(QuoteCell(column.header));
    } else {
      used.push_back(absl::StrCat(QuoteCell(column.header), " → ", taken->first));
    }
  }
  return absl::StrCat(absl::StrJoin(used, ", "),
                      unused.empty() ? "" : "; not used: ", absl::StrJoin(unused, ", "));
}

}  // namespace polyest::internal
