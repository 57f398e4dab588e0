#include "client/cpp/data/row_parser.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <utility>

#include "client/cpp/data/cells.h"
#include "core/common/check.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

const DataColumn& TimeColumnOf(const std::vector<DataColumn>& columns) {
  const auto time = std::find_if(columns.begin(), columns.end(), [](const DataColumn& column) {
    return column.role == DataColumn::kTime;
  });
  POLYEST_CHECK(time != columns.end());
  return *time;
}

bool Has(absl::string_view line, char c) {
  return std::memchr(line.data(), c, line.size()) != nullptr;
}

bool NeedsText(absl::string_view cell) {
  return std::any_of(cell.begin(), cell.end(),
                     [](unsigned char c) { return c == '"' || c >= 0x80; });
}

}  // namespace

RowParser::RowParser(std::vector<DataColumn> columns, char delimiter,
                     const DataFileOptions& options, const TextLines& lines)
    : columns_(std::move(columns)),
      time_column_(TimeColumnOf(columns_)),
      delimiter_(delimiter),
      lines_(lines),
      any_first_run_(options.any_first_run),
      decimal_known_(options.decimal != 0),
      clock_(options, time_column_) {
  if (decimal_known_) style_ = {options.decimal, true};
  seen_.decimal_comma = style_.decimal == ',';
  const auto channels = static_cast<size_t>(std::count_if(
      columns_.begin(), columns_.end(), [](const DataColumn& c) { return c.is_channel(); }));
  row_.values.resize(channels);
  row_.missing.resize(channels);
}

absl::Status RowParser::CellError(const DataColumn& column, absl::string_view message) const {
  return lines_.Error(absl::StrCat("column ", ColumnLabel(column), ": ", message));
}

absl::Status RowParser::Parse(absl::string_view line) {
  if (!decimal_known_) DecideDecimal(line);
  numbers_ = style_.decimal == ',' ? WithPoints(line) : line;
  std::fill(row_.missing.begin(), row_.missing.end(), uint8_t{0});
  row_.any_missing = false;
  channel_ = 0;
  run_ = clock_.run();
  const int64_t words = seen_.missing_words;
  absl::Status parsed = ParseCells(line);
  if (parsed.ok()) {
    parsed = clock_.Next(time_, run_, time_cell_);
    if (parsed.ok()) return parsed;
    parsed = CellError(time_column_, parsed.message());
  }
  seen_.missing_words = words;
  if (words == 0) seen_.missing_word.clear();
  return parsed;
}

// Looks for a decimal mark in the row's numbers. Until a row shows one, whole numbers only have
// been read, which are the same with both.
void RowParser::DecideDecimal(absl::string_view line) {
  const bool may_have_comma = delimiter_ == ',' ? Has(line, '"') : Has(line, ',');
  if (!may_have_comma && (delimiter_ == ',' || !Has(line, '.'))) return;
  bool point = false, comma = false, comma_or_group = false;
  size_t begin = 0;
  for (const DataColumn& column : columns_) {
    const size_t end = std::min(CellEnd(line, begin, delimiter_), line.size());
    if (column.is_channel() || column.role == DataColumn::kTime) {
      const auto evidence = DecimalEvidenceOf(CellText(line.substr(begin, end - begin)));
      point = point || evidence == DecimalEvidence::kPoint;
      comma = comma || evidence == DecimalEvidence::kComma;
      comma_or_group = comma_or_group || evidence == DecimalEvidence::kCommaOrGroup;
    }
    begin = end + 1;
    if (begin > line.size()) break;
  }
  // Semicolons separate cells where the comma is the decimal mark.
  comma = comma || (comma_or_group && delimiter_ == ';');
  decimal_known_ = point || comma;
  if (!point && comma) style_.decimal = ',';
  seen_.decimal_comma = style_.decimal == ',';
}

// Copies the line with a point for each comma, and for each point a character that no number has.
absl::string_view RowParser::WithPoints(absl::string_view line) {
  with_points_.resize(line.size());
  std::transform(line.begin(), line.end(), with_points_.begin(), [](char c) {
    return c == ',' ? '.' : c == '.' ? '\x01' : c;
  });
  return with_points_;
}

absl::Status RowParser::ParseCells(absl::string_view line) {
  size_t at = 0;
  for (const DataColumn& column : columns_) {
    if (at > line.size()) {
      if (MayLack(column)) continue;
      return CheckShape(line);
    }
    if (absl::Status parsed = ParseCell(column, line, at); !parsed.ok()) {
      const absl::Status shape = CheckShape(line);
      return shape.ok() ? parsed : shape;
    }
  }
  return CheckEnd(line, at);
}

// Whether a row may end before this column: spreadsheets leave out empty cells at the end of a row.
// In a line without an end, the cell before may be cut off, too.
bool RowParser::MayLack(const DataColumn& column) const {
  if (column.role != DataColumn::kIgnored) return false;
  return column.name.header.empty() || !lines_.cut_off();
}

// Parses the cell at `at` and moves `at` behind the delimiter after it.
absl::Status RowParser::ParseCell(const DataColumn& column, absl::string_view line, size_t& at) {
  const size_t begin = at;
  const bool is_value = column.is_channel() || column.role == DataColumn::kTime;
  double value = 0;
  if (is_value && ParsePlainNumber(line, at, value)) {
    return TakeValue(column, line.substr(begin, at - 1 - begin), value);
  }
  const size_t end = CellEnd(line, begin, delimiter_);
  if (end == absl::string_view::npos) return CheckShape(line);
  at = end + 1;
  const absl::string_view cell = line.substr(begin, end - begin);
  if (is_value) return ParseWritten(column, cell);
  return column.role == DataColumn::kRun ? ParseRun(column, cell) : absl::OkStatus();
}

// Parses a number without quotes that fills its cell but for blanks. False for any other cell.
bool RowParser::ParsePlainNumber(absl::string_view line, size_t& at, double& value) const {
  // With commas for both, a number would go on into the next cell.
  if (style_.decimal == delimiter_) return false;
  const char* const end = numbers_.data() + numbers_.size();
  const char* place = numbers_.data() + at;
  while (place < end && *place == ' ') ++place;
  const auto [stop, error] = std::from_chars(place, end, value);
  if (error != std::errc() || !std::isfinite(value)) return false;
  const char* next = stop;
  while (next < end && *next == ' ') ++next;
  const auto index = static_cast<size_t>(next - numbers_.data());
  if (index < line.size() && line[index] != delimiter_) return false;
  at = index + 1;
  return true;
}

// Parses a cell in any of the ways in which files write a value.
absl::Status RowParser::ParseWritten(const DataColumn& column, absl::string_view cell) {
  std::string written;
  absl::string_view text = StripCell(cell);
  if (NeedsText(text)) {
    written = CellText(text);
    text = written;
  }
  const NumberCell number = ReadNumberCell(text, style_);
  switch (number.kind) {
    case NumberCell::kNumber:
      return TakeValue(column, cell, number.value);
    case NumberCell::kMissing:
      return TakeMissing(column, text);
    default:
      break;
  }
  if (column.role == DataColumn::kTime && number.kind != NumberCell::kTwoReadings) {
    DateOrder order = DateOrder::kUnknown;
    const bool is_time = ReadClockTime(text, order).kind != ClockTime::kNone;
    if (is_time || number.kind == NumberCell::kNoNumber) {
      time_cell_ = StripCell(cell);
      return ParseTime(column, text);
    }
  }
  return NumberError(column, text, number);
}

absl::Status RowParser::ParseTime(const DataColumn& column, absl::string_view text) {
  const absl::Status read = clock_.Read(text, time_);
  return read.ok() ? read : CellError(column, read.message());
}

absl::Status RowParser::TakeValue(const DataColumn& column, absl::string_view cell, double value) {
  if (column.role == DataColumn::kTime) {
    time_ = {CellTime::kNumber, value, 0, false};
    time_cell_ = cell;
    return absl::OkStatus();
  }
  if (!column.conversion.IsIdentity()) {
    value = column.conversion(value);
    if (!std::isfinite(value)) {
      return CellError(column,
                       absl::StrCat(QuoteCell(StripCell(cell)), " ", column.unit,
                                    " is out of the range of a double in ", column.model_unit));
    }
  }
  row_.values[channel_++] = value;
  return absl::OkStatus();
}

absl::Status RowParser::TakeMissing(const DataColumn& column, absl::string_view text) {
  const auto missing = [&](absl::string_view rule) {
    return CellError(column,
                     absl::StrCat("a value is missing",
                                  text.empty() ? "" : absl::StrCat(" (", text, ")"), "; ", rule));
  };
  if (column.role == DataColumn::kTime) return missing("every row needs its time");
  if (!text.empty() && seen_.missing_words++ == 0) seen_.missing_word = std::string(text);
  row_.any_missing = true;
  row_.missing[channel_] = 1;
  row_.values[channel_++] = 0;
  return absl::OkStatus();
}

absl::Status RowParser::ParseRun(const DataColumn& column, absl::string_view cell) {
  const std::string text = CellText(cell);
  int32_t run = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), run);
  if (error != std::errc() || end != text.data() + text.size() || run < 0) {
    return CellError(column, absl::StrCat(QuoteCell(text), " must be a whole number ≥ 0"));
  }
  if (clock_.rows() == 0 && run != 0 && !any_first_run_) {
    return CellError(column, absl::StrCat("the first row's run is ", run, ", it must be 0"));
  }
  if (run < clock_.run()) {
    return CellError(column, absl::StrCat(run, " after ", clock_.run(), "; it must not decrease"));
  }
  run_ = run;
  return absl::OkStatus();
}

// Checks the line behind its last column: there may be delimiters without cells.
absl::Status RowParser::CheckEnd(absl::string_view line, size_t at) const {
  const auto is_empty = [this](char c) { return c == delimiter_ || c == ' ' || c == '\t'; };
  if (at > line.size()) return absl::OkStatus();
  const absl::string_view rest = line.substr(at);
  return std::all_of(rest.begin(), rest.end(), is_empty) ? absl::OkStatus() : CheckShape(line);
}

// Checks that a row has as many cells as the header, except those it may lack, and that no quote is
// open.
absl::Status RowParser::CheckShape(absl::string_view line) const {
  size_t cells = 0;
  for (size_t begin = 0; begin <= line.size(); ++cells) {
    const size_t end = CellEnd(line, begin, delimiter_);
    if (end == absl::string_view::npos) {
      return lines_.Error(absl::StrCat("the quote before ",
                                       QuoteCell(line.substr(line.find('"', begin) + 1)),
                                       " has no end in its line"));
    }
    begin = end + 1;
  }
  const auto last = std::find_if_not(columns_.rbegin(), columns_.rend(),
                                     [this](const DataColumn& c) { return MayLack(c); });
  const auto least = static_cast<size_t>(columns_.rend() - last);
  if (cells >= least && cells <= columns_.size()) return absl::OkStatus();
  std::string message =
      absl::StrCat("the row has ", cells, " cells, the header has ", columns_.size());
  if (cells < columns_.size() && lines_.cut_off()) {
    absl::StrAppend(&message, "; the file ends within this row");
  } else if (cells > columns_.size() && delimiter_ == ',') {
    absl::StrAppend(&message, "; numbers with a decimal comma need another delimiter or quotes");
  }
  return lines_.Error(message);
}

absl::Status RowParser::NumberError(const DataColumn& column, absl::string_view text,
                                    const NumberCell& number) const {
  const bool point = style_.decimal == '.';
  const std::string cell = QuoteCell(text);
  switch (number.kind) {
    case NumberCell::kOutOfRange:
      return CellError(column, absl::StrCat(cell, " is out of the range of a double"));
    case NumberCell::kNotFinite:
      return CellError(
          column, absl::StrCat(cell, " must be finite; leave the cell of a missing sample empty"));
    case NumberCell::kTwoReadings:
      return CellError(column, absl::StrCat(cell, " may have a decimal mark or group thousands; ",
                                            "--decimal point or --decimal comma decides"));
    case NumberCell::kOtherDecimal:
      return CellError(
          column, absl::StrCat(cell, " must be a number with a decimal ", point ? "point" : "comma",
                               style_.named     ? ", as --decimal says"
                               : decimal_known_ ? ", as other numbers of the file are"
                                                : "",
                               "; --decimal ", point ? "comma" : "point", " reads it"));
    default:
      return CellError(column, absl::StrCat(cell, " must be a number"));
  }
}

}  // namespace polyest::internal
