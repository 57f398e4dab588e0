#include "client/cpp/data/column_units.h"

#include <absl/strings/str_cat.h>

#include <algorithm>

#include "client/cpp/data/cells.h"
#include "client/cpp/data/clock_time.h"
#include "client/cpp/data/number_cell.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

constexpr char kUnitOfTime[] = "s";

bool IsNumberOrTime(const std::string& cell) {
  DateOrder order = DateOrder::kDayFirst;
  const auto kind = ReadNumberCell(cell, {'.', true}).kind;
  return kind == NumberCell::kNumber || kind == NumberCell::kOtherDecimal ||
         ReadClockTime(cell, order).kind != ClockTime::kNone;
}

bool IsUnit(const std::string& cell) {
  const std::string unit = UnitOfCell(cell);
  return !unit.empty() && unit != "-" && !IsNumberOrTime(unit) && CheckRecordedUnit(unit).ok();
}

std::string ModelUnit(const DataColumn& column, const DataColumns& known) {
  if (column.role == DataColumn::kTime) return kUnitOfTime;
  const auto unit = known.units.find(column.quantity);
  return unit == known.units.end() ? "" : unit->second;
}

std::string StatedUnit(const DataColumn& column, const DataColumns& known) {
  const auto source = known.sources.find(column.quantity);
  return source == known.sources.end() ? "" : source->second.unit;
}

// Sets the unit and the conversion of one column.
absl::Status Resolve(const DataColumns& known, const std::string& unit_cell, DataColumn& column) {
  const std::string stated = StatedUnit(column, known);
  const std::string below = UnitOfCell(unit_cell);
  column.model_unit = ModelUnit(column, known);
  column.unit = !stated.empty() ? stated : !column.name.unit.empty() ? column.name.unit : below;
  const std::string remedy =
      absl::StrCat("; columns.", column.quantity, ".unit of the problem says what the unit is");
  if (stated.empty() && !column.name.unit.empty() && !below.empty() && below != column.name.unit) {
    return absl::InvalidArgumentError(absl::StrCat("the header has the unit ",
                                                   QuoteCell(column.name.unit), ", the row below ",
                                                   QuoteCell(below), remedy));
  }
  if (column.unit.empty() || column.model_unit.empty()) return absl::OkStatus();
  const auto conversion = ConvertUnit(column.unit, column.model_unit);
  if (!conversion.ok()) {
    return absl::InvalidArgumentError(absl::StrCat(conversion.status().message(), remedy));
  }
  column.conversion = *conversion;
  return absl::OkStatus();
}

}  // namespace

bool IsUnitsRow(const std::vector<std::string>& cells, const std::vector<DataColumn>& columns) {
  for (size_t i = 0; i < cells.size(); ++i) {
    const bool may_be_plain = i < columns.size() && columns[i].role != DataColumn::kTime;
    if (IsNumberOrTime(cells[i]) && !(cells[i] == "1" && may_be_plain)) return false;
  }
  return std::any_of(cells.begin(), cells.end(), IsUnit);
}

absl::Status ResolveUnits(const DataColumns& known, const std::vector<std::string>& unit_cells,
                          int64_t line, const TextLines& lines, RefusedLine refused,
                          std::vector<DataColumn>& columns) {
  for (size_t i = 0; i < columns.size(); ++i) {
    DataColumn& column = columns[i];
    if (!column.is_channel() && column.role != DataColumn::kTime) continue;
    const absl::Status resolved =
        Resolve(known, i < unit_cells.size() ? unit_cells[i] : "", column);
    if (resolved.ok()) continue;
    if (column.role == DataColumn::kTime) {
      column.unit_refusal = std::string(resolved.message());
      continue;
    }
    const std::string label = ColumnLabel(column);
    column.role = DataColumn::kRefused;
    POLYEST_RETURN_IF_ERROR(refused(absl::InvalidArgumentError(
        absl::StrCat(lines.name(), ":", line, ": column ", label, ": ", resolved.message()))));
  }
  return absl::OkStatus();
}

}  // namespace polyest::internal
