#pragma once

// Reads measurements from CSV text.
//
// The first line names the columns: `t` first (s), then measured outputs, streamed inputs and,
// if there is more than one run, `run`. Cells are plain numbers; an empty cell of a measured output
// is a missing sample. Blank lines, spaces around a cell, CR LF and a byte order mark are accepted;
// quotes are not.

#include <absl/functional/function_ref.h>
#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <istream>
#include <memory>
#include <string>
#include <vector>

#include "polyest/v1/measurements.pb.h"
#include "polyest/v1/problem.pb.h"

namespace polyest {

// The columns that data for a problem may have besides `t` and `run`.
struct DataColumns {
  std::vector<std::string> measured;  // outputs; each may have missing cells, or no column
  std::vector<std::string> streamed;  // inputs; each must have a column and a value in every row
};

// Returns the columns that data for this problem may have.
DataColumns ColumnsOf(const v1::Problem& problem);

// Receives the error of a refused line. If it returns OK, the line is left out and reading goes on;
// otherwise reading ends with its status.
using RefusedLine = absl::FunctionRef<absl::Status(absl::Status)>;

// Ends the reading at the first refused line, with that line's error.
inline absl::Status StopAtRefusedLine(absl::Status refusal) { return refusal; }

// Reads batches of rows, so a long file or an endless pipe is never in memory as a whole.
class DataReader {
 public:
  // Reads the header. Messages call the file `name`. `in` must outlive the reader.
  // INVALID_ARGUMENT: no header, or a column that is unknown, repeated or missing.
  static absl::StatusOr<DataReader> Open(std::istream& in, std::string name,
                                         const DataColumns& columns,
                                         RefusedLine refused = StopAtRefusedLine);

  // Returns the next rows, at most `max_rows` > 0; no rows at the end of the data. INVALID_ARGUMENT
  // names file, line, column, value and rule. It is the answer to a cell that is not a finite
  // number, a time that does not increase within its run, a run that decreases, a row with too few
  // or too many cells, a streamed input without a value, and data without any row.
  absl::StatusOr<v1::Measurements> Read(int64_t max_rows, RefusedLine refused = StopAtRefusedLine);

 private:
  enum class Role { kTime, kRun, kMeasured, kStreamed, kRefused };
  struct Column {
    std::string name;
    Role role;
    int channel;  // among the channels of a batch; −1 for the others
  };

  DataReader(std::istream& in, std::string name);

  absl::StatusOr<bool> NextLine(absl::string_view& line);
  absl::Status AddColumn(absl::string_view name, const DataColumns& known);
  absl::Status CheckStreamed(const DataColumns& known, RefusedLine refused) const;
  absl::Status ParseRow(absl::string_view line, v1::Measurements& batch);
  absl::Status ParseCells(absl::string_view line, v1::Measurements& batch);
  absl::Status ParseRun(absl::string_view cell);
  absl::Status ParseCell(const Column& column, absl::string_view cell, v1::Measurements& batch);
  absl::Status CheckTime(int64_t previous_run) const;
  absl::StatusOr<double> ParseNumber(const Column& column, absl::string_view cell) const;
  absl::Status LineError(absl::string_view message) const;

  std::istream* in_;
  std::string name_;
  std::unique_ptr<char[]> buffer_;  // the present line
  std::vector<Column> columns_;
  int channels_ = 0;
  bool has_run_ = false;
  int64_t line_ = 0;          // 1-based
  int64_t rows_ = 0;          // accepted so far
  bool any_refused_ = false;  // whether any row has been refused
  double time_s_ = 0;         // of the last accepted row, or of the row being read
  double previous_time_s_ = 0;
  int32_t run_ = 0;
};

// Reads a whole file.
absl::StatusOr<v1::Measurements> ReadDataFile(const std::string& path, const DataColumns& columns,
                                              RefusedLine refused = StopAtRefusedLine);

}  // namespace polyest
