#pragma once

// Measurements as they arrive, and the store that an estimator keeps them in.

#include <absl/status/status.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace polyest {

// The values of one measured output or streamed input.
struct SampleColumn {
  std::string name;           // of a measured output, a streamed input or in Problem::use_when
  std::vector<double> value;  // one for each row, in the quantity's unit; ignored where missing
  std::vector<bool> missing;  // one for each row; empty: none is missing
};

// Measurements: rows in time order, columns by name. Any of them may miss a sample in any row, so
// that each quantity has its own times; one without a column has no samples in these rows.
struct Samples {
  std::vector<double> time_s;  // ≥ 0, strictly increasing within a run
  std::vector<int> run;        // one for each row, from 0, never decreasing; empty: all are run 0
  std::vector<SampleColumn> columns;  // in any order
  // True when the last row's run has no further rows. There may then be no rows here at all.
  bool end_of_run = false;

  // The number of rows.
  size_t rows() const { return time_s.size(); }
};

// The place of one row in a record.
struct SampleRow {
  int run = 0;        // from 0
  double time_s = 0;  // since the run began
};

// Consecutive rows of a record that have passed the checks.
struct RowBlock {
  std::vector<SampleRow> rows;  // their places
  // Row by row: the measured outputs in the problem's order, then the streamed inputs in the
  // model's; NaN where missing.
  std::vector<double> values;
  // Row by row: the standard deviation of each measured output's sample, in its unit; 0 where
  // missing.
  std::vector<double> noise;
  // The values that the columns in Problem::use_when have after the last row, NaN without any
  // sample in its run; empty if nothing was checked for it.
  std::vector<double> gate;
  bool run_ended = false;  // whether the last row's run has no further rows

  // The number of rows.
  int count() const { return static_cast<int>(rows.size()); }
  // The number of columns of `values`; 0 without rows.
  size_t width() const { return rows.empty() ? 0 : values.size() / rows.size(); }
};

// Keeps the rows of a record, so that a moved expansion can be computed over them again. An
// estimator keeps them in memory unless it is given another store (EstimatorOptions::store), such
// as one on disk. Rows are appended and never changed. Only the estimator's own thread calls it.
class SampleStore {
 public:
  virtual ~SampleStore() = default;
  // The number of rows appended.
  virtual int64_t rows() const = 0;
  // Appends the whole block with its run_ended, or nothing and says why. A block without rows only
  // marks the last row's run as ended.
  virtual absl::Status Append(const RowBlock& block) = 0;
  // Reads rows [first, first + count), which must be there, into the block.
  virtual absl::Status Read(int64_t first, int64_t count, RowBlock& block) const = 0;
};

}  // namespace polyest
