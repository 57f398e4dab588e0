#include "client/cpp/data/found_text.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <vector>

#include "client/cpp/data/cells.h"

namespace polyest::internal {
namespace {

// Quotes a header as messages to users do in a sentence.
std::string InQuotes(const std::string& text) {
  const std::string quoted = QuoteCell(text);
  return absl::StrCat("'", quoted.substr(1, quoted.size() - 2), "'");
}

std::string WithThousands(int64_t number) {
  std::string text = absl::StrCat(number);
  for (size_t at = text.size(); at > 3;) {
    at -= 3;
    text.insert(at, ",");
  }
  return text;
}

std::string Plural(int64_t count, const char* singular, const char* plural) {
  return absl::StrCat(WithThousands(count), " ", count == 1 ? singular : plural);
}

std::string Dialect(const DataFileFound& found) {
  std::vector<std::string> parts;
  const char delimiter = found.header.delimiter;
  if (delimiter != ',') {
    parts.push_back(delimiter == ';'    ? "semicolons"
                    : delimiter == '\t' ? "tabs"
                    : delimiter == '|'  ? "vertical bars"
                                        : absl::StrCat("delimiter ", InQuotes({delimiter})));
  }
  if (found.rows.seen().decimal_comma) parts.emplace_back("decimal comma");
  if (found.encoding != Encoding::kUtf8) parts.emplace_back("UTF-16");
  if (found.header.windows) parts.emplace_back("Windows-1252");
  return absl::StrJoin(parts, ", ");
}

// Returns what a column is; empty for a quantity's own name and unit.
std::string Use(const DataColumn& column) {
  const bool converts = !column.conversion.IsIdentity();
  const bool renamed = column.name.header != column.quantity;
  std::string units;
  if (converts) {
    units = absl::StrCat(", ", column.unit, " → ", column.model_unit);
  } else if (column.is_channel() && !column.unit.empty() && column.model_unit.empty()) {
    units = absl::StrCat(" in ", column.unit, ", not converted");
  }
  if (!renamed && units.empty()) return "";
  const std::string header = InQuotes(column.name.header);
  if (column.role == DataColumn::kTime) return absl::StrCat(header, " is t", units);
  return renamed ? absl::StrCat(header, " → ", column.quantity, units)
                 : absl::StrCat(header, units);
}

std::string Ignored(const std::vector<DataColumn>& columns) {
  constexpr int kMaxNamed = 4;
  std::vector<std::string> names;
  int count = 0;
  for (const DataColumn& column : columns) {
    if (column.role != DataColumn::kIgnored || column.name.header.empty()) continue;
    if (++count <= kMaxNamed) names.push_back(InQuotes(column.name.header));
  }
  if (count == 0) return "";
  if (count > kMaxNamed) names.emplace_back("…");
  return absl::StrCat(Plural(count, "column", "columns"), " ignored (", absl::StrJoin(names, ", "),
                      ")");
}

std::string Rows(const RowClock& clock, bool whole) {
  if (clock.rows() == 0) return "0 rows";
  const std::string rows = whole ? Plural(clock.rows(), "row", "rows")
                           : clock.rows() == 1
                               ? "the first row"
                               : absl::StrCat("the first ", WithThousands(clock.rows()), " rows");
  if (!clock.from_first_row()) return absl::StrFormat("%s from %.9g s", rows, clock.first_time_s());
  return absl::StrCat(rows, ", t = 0 at ", CellText(clock.first_cell()));
}

}  // namespace

std::string FoundText(const DataFileFound& found) {
  std::vector<std::string> parts = {Dialect(found)};
  if (found.header.lines_above > 0) {
    parts.push_back(absl::StrCat(Plural(found.header.lines_above, "line", "lines"),
                                 " above the header left out"));
  }
  if (found.header.in_comment) parts.emplace_back("the header is a comment");
  if (found.units_line > 0) parts.push_back(absl::StrCat("units in line ", found.units_line));
  for (const DataColumn& column : found.rows.columns()) {
    if (column.role == DataColumn::kTime || column.is_channel() ||
        column.role == DataColumn::kRun) {
      parts.push_back(Use(column));
    }
  }
  parts.push_back(Ignored(found.rows.columns()));
  if (const RowsSeen& seen = found.rows.seen(); seen.missing_words > 0) {
    parts.push_back(absl::StrCat(Plural(seen.missing_words, "cell", "cells"), " such as ",
                                 InQuotes(seen.missing_word), " taken for missing samples"));
  }
  const bool plain =
      std::all_of(parts.begin(), parts.end(), [](const std::string& part) { return part.empty(); });
  if (plain && !found.rows.clock().from_first_row()) return "";
  parts.push_back(Rows(found.rows.clock(), found.whole));
  std::erase(parts, "");
  return absl::StrJoin(parts, "; ");
}

}  // namespace polyest::internal
