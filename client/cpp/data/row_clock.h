#pragma once

// The time and the run of each row.

#include <absl/status/status.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <string>

#include "client/cpp/data/clock_time.h"
#include "client/cpp/data/column_map.h"
#include "polyest/data_file.h"

namespace polyest::internal {

// The time of a row as its cell says it.
struct CellTime {
  enum Form { kNumber, kTimeOfDay, kDate };
  Form form = kNumber;
  double number = 0;        // of kNumber, in the unit of the column
  int64_t nanoseconds = 0;  // of the other forms
  bool has_zone = false;
};

// Turns the times of rows into seconds and checks that they increase, unless any order is allowed.
// Errors are sentences without file and line.
class RowClock {
 public:
  RowClock(const DataFileOptions& options, const DataColumn& column);

  // Reads the text of a time that is not a plain number.
  absl::Status Read(absl::string_view text, CellTime& time);
  // Sets the time and the run of the next row; `cell` is its time for messages. After an error the
  // row does not count.
  absl::Status Next(const CellTime& time, int32_t run, absl::string_view cell);

  double time_s() const { return time_s_; }  // of the last row
  int32_t run() const { return run_; }
  int64_t rows() const { return rows_; }
  double first_time_s() const { return first_time_s_; }
  // Whether times count from the first row of their run.
  bool from_first_row() const { return from_first_row_; }
  // The cell of the first row's time.
  const std::string& first_cell() const { return first_cell_; }

 private:
  absl::Status CheckForm(const CellTime& time) const;
  double Seconds(const CellTime& time, const CellTime& zero) const;
  absl::Status Error(absl::string_view cell, double time_s, absl::string_view rule) const;

  const DataFileOptions options_;
  const DataColumn column_;
  DateOrder order_;
  CellTime zero_;   // the time 0 of the run; 0 if times are those of the file
  CellTime first_;  // the first row's
  std::string first_cell_;
  bool from_first_row_ = false;
  double time_s_ = 0;
  bool went_back_ = false;  // whether a row after the last one was refused for its time
  double first_time_s_ = 0;
  int32_t run_ = 0;
  int64_t rows_ = 0;
};

}  // namespace polyest::internal
