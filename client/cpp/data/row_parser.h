#pragma once

// Parses the rows of a data file.

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <string>
#include <vector>

#include "client/cpp/data/column_map.h"
#include "client/cpp/data/number_cell.h"
#include "client/cpp/data/row_clock.h"
#include "client/cpp/data/text_lines.h"
#include "polyest/data_file.h"

namespace polyest::internal {

// One row. Entries of channels are in the order of their columns.
struct Row {
  std::vector<double> values;    // by channel; 0 for a missing sample
  std::vector<uint8_t> missing;  // by channel: 1 for a missing sample
  bool any_missing = false;
};

// What the rows so far have shown.
struct RowsSeen {
  bool decimal_comma = false;
  int64_t missing_words = 0;  // missing samples that are not empty cells
  std::string missing_word;   // the first of them
};

// Allocates nothing for a row of plain numbers.
class RowParser {
 public:
  // `lines` gives the place for messages and must outlive the object.
  RowParser(std::vector<DataColumn> columns, char delimiter, const DataFileOptions& options,
            const TextLines& lines);

  // Parses the last line read. After an error, the line counts as not there.
  absl::Status Parse(absl::string_view line);

  const Row& row() const { return row_; }
  const RowClock& clock() const { return clock_; }
  const RowsSeen& seen() const { return seen_; }
  const std::vector<DataColumn>& columns() const { return columns_; }

 private:
  void DecideDecimal(absl::string_view line);
  absl::string_view WithPoints(absl::string_view line);
  absl::Status ParseCells(absl::string_view line);
  absl::Status ParseCell(const DataColumn& column, absl::string_view line, size_t& at);
  bool ParsePlainNumber(absl::string_view line, size_t& at, double& value) const;
  absl::Status ParseWritten(const DataColumn& column, absl::string_view cell);
  absl::Status ParseTime(const DataColumn& column, absl::string_view text);
  absl::Status ParseRun(const DataColumn& column, absl::string_view cell);
  absl::Status TakeMissing(const DataColumn& column, absl::string_view text);
  absl::Status TakeValue(const DataColumn& column, absl::string_view cell, double value);
  absl::Status CheckEnd(absl::string_view line, size_t at) const;
  bool MayLack(const DataColumn& column) const;
  absl::Status CheckShape(absl::string_view line) const;
  absl::Status NumberError(const DataColumn& column, absl::string_view text,
                           const NumberCell& number) const;
  absl::Status CellError(const DataColumn& column, absl::string_view message) const;

  const std::vector<DataColumn> columns_;
  const DataColumn& time_column_;
  const char delimiter_;
  const TextLines& lines_;
  const bool any_first_run_;
  NumberStyle style_;
  bool decimal_known_;
  std::string with_points_;    // the line with decimal points in place of commas
  absl::string_view numbers_;  // the line in which plain numbers are looked for
  Row row_;
  size_t channel_ = 0;  // of the next value
  CellTime time_;       // of the row being parsed
  absl::string_view time_cell_;
  int32_t run_ = 0;
  RowClock clock_;
  RowsSeen seen_;
};

}  // namespace polyest::internal
