#pragma once

// Reads measurements from CSV text as measuring systems and spreadsheets write it.
//
// Found out by itself and said by DataReader::Found():
//   encoding      UTF-8, UTF-16 (with a byte order mark or without), Windows-1252 and Latin-1
//   line ends     LF, CR LF or CR; blank lines and lines that begin with # are left out
//   delimiter     , ; tab or |, by the header
//   header        the first line that names the time and a quantity; lines above it are left out.
//                 The last line of comments may be the header
//   units         in the header, "Disp [mm]", "Disp (mm)", "Disp / mm" or "v / (m/s)", or in a
//                 row below it
//   columns       a quantity's column has its name, or its name before a unit, or is named by
//                 `DataColumns::sources`; the time is t, time, Zeit, timestamp, … Other columns are
//                 left out. `run` (0, 1, 2 …) begins a new run at each change
//   numbers       with a decimal point or a decimal comma; 1e5, +1, thousands that are grouped
//   missing       an empty cell, NaN, NA, N/A, #N/A, #NV, null, -
//   times         numbers in the unit of their column, hh:mm:ss.fff, or dates
//                 (2026-01-31T13:00:00.5Z, 31.01.2026 13:00:00,5). Dates count from the first row
//
// Where two readings are possible, the file is refused, and the message names the option that
// decides.

#include <absl/functional/function_ref.h>
#include <absl/status/status.h>
#include <absl/status/statusor.h>
#include <absl/strings/string_view.h>

#include <cstdint>
#include <istream>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "polyest/v1/measurements.pb.h"
#include "polyest/v1/problem.pb.h"

namespace polyest {

// What the user says about a file; the rest is found out.
struct DataFileOptions {
  // What the time 0 is.
  enum class TimeZero {
    kAutomatic,  // kFile for numbers and times of day, kFirst for dates
    kFile,       // times as they stand in the file
    kFirst,      // the first row of each run has the time 0
  };
  // The order of day and month in dates such as 01/02/2026; kAutomatic: as a date shows it that is
  // possible in one order only.
  enum class DateOrder { kAutomatic, kDayFirst, kMonthFirst };

  char delimiter = 0;                            // 0: found out
  char decimal = 0;                              // '.' or ','; 0: found out
  TimeZero time_zero = TimeZero::kAutomatic;     // what the time 0 is
  DateOrder date_order = DateOrder::kAutomatic;  // the order in all dates
  std::string time_column;                       // header of the time; empty: found out
  bool any_order = false;                        // whether a run's rows may be in any order of time
  bool any_first_run = false;  // whether the first row's run may be another than 0
  // Whether a last line without its end is left out: the program that wrote it may have ended in
  // the middle of a number.
  bool whole_lines = false;
};

// Where a quantity is in a file, as in Problem.columns. Empty fields are found out.
struct ColumnSource {
  std::string from;  // the column's header, with its unit or without
  std::string unit;  // of the column's values
};

// What data for a problem may have besides `t` and `run`, and how a file holds it.
struct DataColumns {
  std::vector<std::string> measured;  // outputs; each may have missing cells, or no column
  std::vector<std::string> streamed;  // inputs; each must have a column, and may have missing cells
  // By quantity: an output, an input, `t` or `run`.
  std::map<std::string, ColumnSource> sources = {};
  // The model's units by quantity. Values of a quantity without one are not converted.
  std::map<std::string, std::string> units = {};
  // What the user says about the file.
  DataFileOptions options = {};
  // Columns that only the problem's condition `useWhen` names, as `streamed`.
  std::vector<std::string> conditions = {};
};

// Returns the columns that data for this problem may have, with the sources that it names. The
// units are those of its model, which only the caller knows: they are left empty.
DataColumns ColumnsOf(const v1::Problem& problem);

// The lines of a file that its rows are on. In an endless pipe with a line between its rows those
// of the oldest rows are forgotten.
class RowLines {
 public:
  // Adds the next row.
  void Add(int64_t line);
  // Returns the number of the line, from 1, of a row, from 0; 0 if there is no such row or its line
  // has been forgotten.
  int64_t LineOf(int64_t row) const;

 private:
  // Rows on successive lines.
  struct Piece {
    int64_t first_row;
    int64_t first_line;
  };

  std::vector<Piece> pieces_;
  int64_t rows_ = 0;
};

// Receives the error of a refused line. If it returns OK, the line is left out and reading goes on;
// otherwise reading ends with its status.
using RefusedLine = absl::FunctionRef<absl::Status(absl::Status)>;

// Ends the reading at the first refused line, with that line's error.
inline absl::Status StopAtRefusedLine(absl::Status refusal) { return refusal; }

// Reads batches of rows, so a long file or an endless pipe is never in memory as a whole. Never
// waits for more of a pipe than the row it returns.
class DataReader {
 public:
  // Reads the header. Messages call the file `name`. `in` must outlive the reader.
  // INVALID_ARGUMENT: no header, no column for the time, for any measured output or for a streamed
  // input, a column that is there twice, a unit of another dimension, or a name that is nearly that
  // of a missing quantity.
  static absl::StatusOr<DataReader> Open(std::istream& in, std::string name,
                                         const DataColumns& columns,
                                         RefusedLine refused = StopAtRefusedLine);
  // Moving leaves a reader that may only be destroyed or assigned to.
  DataReader(DataReader&& other) noexcept;
  // Takes over the other reader's place in its text.
  DataReader& operator=(DataReader&& other) noexcept;
  ~DataReader();

  // Returns the next rows, at most `max_rows` > 0; no rows at the end of the data. Values are in
  // the model's units, times in s. INVALID_ARGUMENT names file, line, column, value and rule, and
  // the option that would read the value. It is the answer to a cell that is not a finite number, a
  // time that does not increase within its run, a run that decreases, a row with too few or too
  // many cells, and data without any row.
  absl::StatusOr<v1::Measurements> Read(int64_t max_rows, RefusedLine refused = StopAtRefusedLine);

  // As above, into `batch`, which has the rows before the refused line also after an error.
  absl::Status Read(int64_t max_rows, v1::Measurements& batch,
                    RefusedLine refused = StopAtRefusedLine);

  // Returns what has been found out so far, in one line: "data.csv: semicolons, decimal comma;
  // 'Disp [mm]' → x, mm → m; 600 rows from 0 s", or "the first 600 rows" before the end of the data
  // is reached. Empty for a file that has commas, decimal points
  // and columns of the quantities' own names in the model's units only.
  std::string Found() const;

  // Says, once it is read, that the last line has no end: that it is left out, with `whole_lines`,
  // or that its last value may be cut off. Empty if there is no such line.
  std::string UnendedLine() const;

  // Returns the lines of the rows read so far, for messages about a row.
  const RowLines& Lines() const;

  // Whether the times read so far count from the first row of their run, as dates do.
  bool CountsFromFirstRow() const;

 private:
  class Reader;
  explicit DataReader(std::unique_ptr<Reader> reader);

  std::unique_ptr<Reader> reader_;
};

// Reads a whole file. Writes Found() and UnendedLine(), a line each, to `found` and Lines() to
// `lines` unless they are null.
absl::StatusOr<v1::Measurements> ReadDataFile(const std::string& path, const DataColumns& columns,
                                              RefusedLine refused = StopAtRefusedLine,
                                              std::string* found = nullptr,
                                              RowLines* lines = nullptr);

}  // namespace polyest
