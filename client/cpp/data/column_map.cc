#include "client/cpp/data/column_map.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/strip.h>

#include <algorithm>
#include <utility>

#include "client/cpp/data/cells.h"
#include "core/common/nearest_name.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

// Returns the headers of columns for a message.
std::string Headers(const std::vector<DataColumn>& columns) {
  constexpr size_t kMaxShown = 20;
  std::vector<std::string> headers;
  for (const DataColumn& column : columns) {
    if (!column.name.header.empty()) headers.push_back(QuoteCell(column.name.header));
  }
  const size_t count = headers.size();
  if (count > kMaxShown) headers.resize(kMaxShown);
  return absl::StrCat(absl::StrJoin(headers, ", "),
                      count > kMaxShown ? absl::StrCat(", … (", count, " columns)") : "");
}

// Returns a text as a JSON string, whole: users copy it.
std::string JsonText(const std::string& text) {
  std::string escaped = absl::StrReplaceAll(text, {{"\\", "\\\\"}, {"\"", "\\\""}});
  std::replace_if(
      escaped.begin(), escaped.end(), [](unsigned char c) { return c < ' '; }, ' ');
  return absl::StrCat("\"", escaped, "\"");
}

// Returns the line of a problem that maps a column.
std::string SourceLine(const std::string& quantity, const std::string& header) {
  return absl::StrCat("\"columns\": {", JsonText(quantity), ": {\"from\": ", JsonText(header),
                      "}}");
}

std::string WithoutDigits(absl::string_view name) {
  std::string rest;
  std::copy_if(name.begin(), name.end(), std::back_inserter(rest),
               [](unsigned char c) { return !absl::ascii_isdigit(c); });
  return rest;
}

// Whether an ending of a header can only be a unit: x_in may be an input and x_min a minimum.
bool IsUnitEnding(const std::string& ending, const std::string& model_unit) {
  if (ending.empty() || absl::ascii_isdigit(static_cast<unsigned char>(ending[0]))) return false;
  if (ending == "in" || ending == "min") return false;
  return ConvertUnit(ending, model_unit).ok();
}

// Returns what stands behind a name in a header as a unit would: in parentheses or behind a slash.
std::string BehindName(absl::string_view header, const std::string& name) {
  if (!absl::ConsumePrefix(&header, name)) return "";
  header = absl::StripAsciiWhitespace(header);
  const bool in_parentheses =
      absl::ConsumePrefix(&header, "(") && absl::ConsumeSuffix(&header, ")");
  if (!in_parentheses && !absl::ConsumePrefix(&header, "/")) return "";
  return std::string(absl::StripAsciiWhitespace(header));
}

class Mapping {
 public:
  Mapping(const Header& header, const DataColumns& known, const TextLines& lines,
          RefusedLine refused)
      : header_line_(header.line), known_(known), lines_(lines), refused_(refused) {
    for (const ColumnName& name : header.names) columns_.push_back({.name = name});
  }

  absl::StatusOr<std::vector<DataColumn>> Run() {
    for (const std::string& output : known_.measured) {
      POLYEST_RETURN_IF_ERROR(Map(output, DataColumn::kMeasured));
    }
    for (const std::string& input : known_.streamed) {
      POLYEST_RETURN_IF_ERROR(Map(input, DataColumn::kStreamed));
    }
    for (const std::string& condition : known_.conditions) {
      POLYEST_RETURN_IF_ERROR(Map(condition, DataColumn::kStreamed));
    }
    POLYEST_RETURN_IF_ERROR(Map("run", DataColumn::kRun));
    POLYEST_RETURN_IF_ERROR(MapTime());
    POLYEST_RETURN_IF_ERROR(CheckUnits());
    POLYEST_RETURN_IF_ERROR(CheckSpelling());
    for (const std::string& input : known_.streamed) {
      POLYEST_RETURN_IF_ERROR(CheckThere(input, " for the streamed input of that name"));
    }
    for (const std::string& condition : known_.conditions) {
      POLYEST_RETURN_IF_ERROR(CheckThere(condition, ", which useWhen names,"));
    }
    POLYEST_RETURN_IF_ERROR(CheckMeasured());
    return std::move(columns_);
  }

 private:
  absl::Status Error(const std::string& message) const {
    return absl::InvalidArgumentError(
        absl::StrCat(lines_.name(), ":", header_line_, ": ", message));
  }

  std::string Source(const std::string& quantity) const {
    const auto source = known_.sources.find(quantity);
    return source == known_.sources.end() ? "" : source->second.from;
  }

  bool HasColumn(const std::string& quantity) const {
    return std::any_of(columns_.begin(), columns_.end(),
                       [&](const DataColumn& column) { return column.quantity == quantity; });
  }

  // Returns the end of a message: the line of a problem that maps the first column that is not
  // used. Empty if all are.
  std::string MapOne(const std::string& quantity) const {
    for (const DataColumn& column : columns_) {
      if (column.role == DataColumn::kIgnored && !column.name.header.empty()) {
        return absl::StrCat("; map one in the problem: ", SourceLine(quantity, column.name.header));
      }
    }
    return "";
  }

  // Returns the columns with the whole header `wanted` or, if there is none, with that name.
  std::vector<DataColumn*> Find(const std::string& wanted) {
    std::vector<DataColumn*> whole, named;
    for (DataColumn& column : columns_) {
      if (column.name.header == wanted) whole.push_back(&column);
      if (column.name.name == wanted) named.push_back(&column);
    }
    return whole.empty() ? named : whole;
  }

  // Whether a header is the name of a quantity or mapped to one.
  bool IsTaken(const std::string& header) const {
    const auto has = [&](const auto& names) {
      return std::find(names.begin(), names.end(), header) != names.end();
    };
    return has(known_.measured) || has(known_.streamed) || has(known_.conditions) ||
           std::any_of(known_.sources.begin(), known_.sources.end(),
                       [&](const auto& source) { return source.second.from == header; });
  }

  // Returns the columns whose headers are the quantity's name with a unit that the model's can be
  // converted from, as x_mm, and parts these headers.
  std::vector<DataColumn*> FindWithEnding(const std::string& quantity) {
    std::vector<DataColumn*> found;
    const auto unit = known_.units.find(quantity);
    if (unit == known_.units.end()) return found;
    for (DataColumn& column : columns_) {
      absl::string_view ending = column.name.header;
      if (column.role != DataColumn::kIgnored || !absl::ConsumePrefix(&ending, quantity) ||
          !absl::ConsumePrefix(&ending, "_") || IsTaken(column.name.header) ||
          !IsUnitEnding(std::string(ending), unit->second)) {
        continue;
      }
      column.name.unit = std::string(ending);
      column.name.name = quantity;
      found.push_back(&column);
    }
    return found;
  }

  absl::Status Map(const std::string& quantity, DataColumn::Role role) {
    const std::string source = Source(quantity);
    std::vector<DataColumn*> found = Find(source.empty() ? quantity : source);
    if (found.empty() && source.empty()) found = FindWithEnding(quantity);
    if (found.empty()) {
      if (source.empty()) return absl::OkStatus();
      return refused_(Error(absl::StrCat(
          "there is no column ", QuoteCell(source), " for ", quantity, " (columns.", quantity,
          ".from of the problem); the file's columns are ", Headers(columns_))));
    }
    return Claim(found, quantity, role);
  }

  absl::Status Claim(const std::vector<DataColumn*>& found, const std::string& quantity,
                     DataColumn::Role role) {
    DataColumn& first = *found.front();
    const bool repeated = found.size() > 1;
    const bool taken = first.role != DataColumn::kIgnored;
    if (!repeated && !taken) {
      first.role = role;
      first.quantity = quantity;
      return absl::OkStatus();
    }
    const std::string refusal =
        repeated ? absl::StrCat("the column ", QuoteCell(first.name.header), " is named twice",
                                found[1]->name.header == first.name.header
                                    ? ""
                                    : absl::StrCat(", also as ", QuoteCell(found[1]->name.header)),
                                "; columns.", quantity, ".from of the problem takes a whole header")
                 : absl::StrCat("the column ", QuoteCell(first.name.header), " would be both ",
                                first.quantity, " and ", quantity);
    for (DataColumn* const column : found) {
      column->role = DataColumn::kRefused;
      column->quantity = quantity;
    }
    return refused_(Error(refusal));
  }

  // Finds the time. Without it, no row can be read.
  absl::Status MapTime() {
    std::vector<DataColumn*> found;
    for (DataColumn& column : columns_) {
      if (column.role == DataColumn::kIgnored && MayBeTime(column.name, known_)) {
        found.push_back(&column);
      }
    }
    const std::string& option = known_.options.time_column;
    const bool named = !option.empty() || !Source("t").empty();
    if (found.size() > 1) KeepExact(named ? (option.empty() ? Source("t") : option) : "t", found);
    if (found.empty()) return NoTime();
    if (found.size() > 1) {
      const bool same = found[0]->name.header == found[1]->name.header;
      return Error(absl::StrCat(
          same ? absl::StrCat("the column ", QuoteCell(found[0]->name.header), " is named twice")
               : absl::StrCat("the time may be ", QuoteCell(found[0]->name.header), " or ",
                              QuoteCell(found[1]->name.header), "; --time-column decides")));
    }
    found.front()->role = DataColumn::kTime;
    found.front()->quantity = "t";
    return absl::OkStatus();
  }

  // Keeps the columns with the whole header or the name `wanted`, if there are any.
  static void KeepExact(const std::string& wanted, std::vector<DataColumn*>& found) {
    for (const auto member : {&ColumnName::header, &ColumnName::name}) {
      std::vector<DataColumn*> exact;
      std::copy_if(found.begin(), found.end(), std::back_inserter(exact),
                   [&](const DataColumn* column) { return column->name.*member == wanted; });
      if (exact.empty()) continue;
      found = std::move(exact);
      return;
    }
  }

  absl::Status NoTime() const {
    const std::string& option = known_.options.time_column;
    const std::string wanted = option.empty() ? Source("t") : option;
    const std::string first = columns_.front().name.header;
    if (columns_.size() == 1 && known_.options.delimiter != 0) {
      return Error(absl::StrCat("the file has one column with the delimiter ",
                                QuoteCell(std::string(1, known_.options.delimiter)),
                                " that --delimiter names: ", QuoteCell(first),
                                "; without the option, the delimiter is found out"));
    }
    if (columns_.size() == 1 && first.find(' ') != first.npos) {
      return Error(absl::StrCat("the first line must name the columns, but ", QuoteCell(first),
                                " is one cell: cells are separated by commas, semicolons, tabs or "
                                "|, not by blanks"));
    }
    for (const DataColumn& column : columns_) {
      const bool named = column.name.header == wanted || column.name.name == wanted;
      if (wanted.empty() || !named || column.quantity.empty()) continue;
      return Error(absl::StrCat("the column ", QuoteCell(wanted),
                                " cannot be the time, since it is ", column.quantity,
                                " of the problem; the file's columns are ", Headers(columns_)));
    }
    return Error(absl::StrCat(
        wanted.empty() ? "no column is the time t"
                       : absl::StrCat("there is no column ", QuoteCell(wanted), " for the time"),
        "; the first line must name the columns, and the file's columns are ", Headers(columns_),
        "; --time-column ", QuoteCell(first), " or ", SourceLine("t", first),
        " in the problem names it"));
  }

  // Returns the quantities without a column.
  std::vector<std::string> Missing() const {
    std::vector<std::string> missing;
    for (const auto* const names : {&known_.measured, &known_.streamed, &known_.conditions}) {
      std::copy_if(names->begin(), names->end(), std::back_inserter(missing),
                   [&](const std::string& name) { return !HasColumn(name); });
    }
    return missing;
  }

  // Refuses columns with the name of a quantity without a column, and behind it what is no unit.
  absl::Status CheckUnits() {
    for (const std::string& name : Missing()) {
      for (DataColumn& column : columns_) {
        const std::string unit = BehindName(column.name.header, name);
        if (column.role != DataColumn::kIgnored || unit.empty()) continue;
        const absl::Status checked = CheckRecordedUnit(unit);
        if (checked.ok()) continue;
        column.role = DataColumn::kRefused;
        column.quantity = name;
        POLYEST_RETURN_IF_ERROR(refused_(Error(absl::StrCat(
            "column ", QuoteCell(column.name.header), ": ", checked.message(), "; if it is ", name,
            ", map it in the problem: ", SourceLine(name, column.name.header)))));
      }
    }
    return absl::OkStatus();
  }

  // Refuses columns whose names are nearly that of a quantity without a column.
  absl::Status CheckSpelling() {
    const std::vector<std::string> missing = Missing();
    for (DataColumn& column : columns_) {
      if (column.role != DataColumn::kIgnored || column.name.name.empty()) continue;
      std::string nearest = NearestName(column.name.name, missing);
      if (!HasColumn("run") && absl::EqualsIgnoreCase(column.name.name, "run")) nearest = "run";
      // vel1 and vel2 are two channels, not a slip.
      if (nearest.empty() || WithoutDigits(nearest) == WithoutDigits(column.name.name)) continue;
      column.role = DataColumn::kRefused;
      POLYEST_RETURN_IF_ERROR(refused_(Error(absl::StrCat(
          "unknown column ", QuoteCell(column.name.header), "; did you mean ", QuoteCell(nearest),
          "? Rename it, or map it in the problem: ", SourceLine(nearest, column.name.header)))));
    }
    return absl::OkStatus();
  }

  absl::Status CheckThere(const std::string& name, const char* purpose) {
    if (HasColumn(name) || !Source(name).empty()) return absl::OkStatus();
    return refused_(Error(absl::StrCat("the column ", QuoteCell(name), purpose,
                                       " is missing; the file's columns are ", Headers(columns_),
                                       MapOne(name))));
  }

  absl::Status CheckMeasured() const {
    const auto& names = known_.measured;
    const bool any = std::any_of(names.begin(), names.end(),
                                 [&](const std::string& name) { return HasColumn(name); });
    if (names.empty() || any) return absl::OkStatus();
    return Error(absl::StrCat("no column is a measured output of the problem (",
                              absl::StrJoin(names, ", "), "); the file's columns are ",
                              Headers(columns_), MapOne(names.front())));
  }

  const int64_t header_line_;
  const DataColumns& known_;
  const TextLines& lines_;
  const RefusedLine refused_;
  std::vector<DataColumn> columns_;
};

}  // namespace

absl::StatusOr<std::vector<DataColumn>> MapColumns(const Header& header, const DataColumns& known,
                                                   const TextLines& lines, RefusedLine refused) {
  return Mapping(header, known, lines, refused).Run();
}

std::string ColumnLabel(const DataColumn& column) {
  if (column.name.header == column.quantity) return column.quantity;
  return absl::StrCat(QuoteCell(column.name.header), " (", column.quantity, ")");
}

}  // namespace polyest::internal
