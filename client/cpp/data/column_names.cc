#include "client/cpp/data/column_names.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/strip.h>

#include <algorithm>

#include "client/cpp/data/cells.h"
#include "core/model/unit_conversion.h"

namespace polyest::internal {
namespace {

constexpr absl::string_view kTimeNames[] = {
    "t",          "time",     "timestamp",   "time stamp", "datetime",     "date/time",
    "date time",  "zeit",     "zeitstempel", "zeitpunkt",  "uhrzeit",      "datum/zeit",
    "datum zeit", "messzeit", "temps",       "horodatage", "tiempo",       "tempo",
    "tid",        "tijd",     "czas",        "elapsed",    "elapsed time", "elapsed_time",
    "time_stamp", "date_time"};

constexpr absl::string_view kTimeEndings[] = {"_s", "_ms", "_us", "_ns", "_min"};

// Parts "name open unit close", and "name / open unit close" as ISO 80000 writes a unit that is a
// fraction itself: "v / (m/s)".
bool PartBrackets(absl::string_view header, char open, char close, ColumnName& column) {
  if (header.empty() || header.back() != close) return false;
  const size_t begin = header.rfind(open);
  if (begin == absl::string_view::npos) return false;
  column.unit = std::string(StripCell(header.substr(begin + 1, header.size() - begin - 2)));
  absl::string_view name = StripCell(header.substr(0, begin));
  if (absl::ConsumeSuffix(&name, "/")) name = StripCell(name);
  column.name = std::string(name);
  return !column.name.empty();
}

// Parts "name / unit" and "name/unit", as standards write axes and tables, and "name in unit".
bool PartSeparator(absl::string_view header, ColumnName& column) {
  for (const absl::string_view separator : {" / ", "/", " in "}) {
    const size_t at = header.find(separator);
    if (at == absl::string_view::npos) continue;
    column.unit = std::string(StripCell(header.substr(at + separator.size())));
    column.name = std::string(StripCell(header.substr(0, at)));
    if (!column.name.empty() && CheckRecordedUnit(column.unit).ok()) return true;
  }
  return false;
}

bool PartTimeEnding(absl::string_view header, ColumnName& column) {
  for (const absl::string_view ending : kTimeEndings) {
    absl::string_view name = header;
    if (!absl::ConsumeSuffix(&name, ending) || !IsUsualTimeName(name)) continue;
    column.name = std::string(name);
    column.unit = std::string(ending.substr(1));
    return true;
  }
  return false;
}

// Whether text is a unit, but not of a time. "hh:mm:ss" and "UTC" are no units.
bool IsUnitOfAnother(const std::string& text) {
  return !text.empty() && CheckRecordedUnit(text).ok() && !ConvertUnit(text, "s").ok();
}

}  // namespace

ColumnName ParseColumnName(absl::string_view header) {
  ColumnName column;
  column.header = std::string(StripCell(header));
  const absl::string_view whole = column.header;
  if (PartBrackets(whole, '[', ']', column)) return column;
  if (PartBrackets(whole, '(', ')', column) && CheckRecordedUnit(column.unit).ok()) return column;
  if (PartSeparator(whole, column)) return column;
  if (PartTimeEnding(whole, column)) return column;
  column.name = column.header;
  column.unit.clear();
  return column;
}

std::string UnitOfCell(absl::string_view cell) {
  cell = StripCell(cell);
  for (const absl::string_view brackets : {"[]", "()"}) {
    if (cell.size() >= 2 && cell.front() == brackets[0] && cell.back() == brackets[1]) {
      cell = StripCell(cell.substr(1, cell.size() - 2));
    }
  }
  return std::string(cell);
}

bool IsUsualTimeName(absl::string_view name) {
  if (name == "T") return false;  // a temperature
  return std::any_of(std::begin(kTimeNames), std::end(kTimeNames), [name](absl::string_view usual) {
    return absl::EqualsIgnoreCase(name, usual);
  });
}

bool IsColumnOf(const ColumnName& column, const std::string& quantity, const DataColumns& columns) {
  const auto source = columns.sources.find(quantity);
  const bool named = source != columns.sources.end() && !source->second.from.empty();
  const std::string& wanted = named ? source->second.from : quantity;
  return column.header == wanted || column.name == wanted;
}

bool MayBeTime(const ColumnName& column, const DataColumns& columns) {
  const std::string& named = columns.options.time_column;
  if (!named.empty()) return column.header == named || column.name == named;
  const auto source = columns.sources.find("t");
  if (source != columns.sources.end() && !source->second.from.empty()) {
    return IsColumnOf(column, "t", columns);
  }
  return IsUsualTimeName(column.name) && !IsUnitOfAnother(column.unit);
}

}  // namespace polyest::internal
