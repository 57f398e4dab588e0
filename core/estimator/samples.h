#pragma once

// Measurements as they arrive: rows in time order, columns by name.

#include <absl/status/status.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace polyest {

struct SampleColumn {
  std::string name;           // a measured output or a streamed input
  std::vector<double> value;  // one a row; ignored where missing
  std::vector<bool> missing;  // empty: none is
};

struct Samples {
  std::vector<double> time_s;  // ≥ 0, strictly increasing within a run
  std::vector<int> run;        // one a row, starts at 0, never decreases; empty: all run 0
  std::vector<SampleColumn> columns;
  // No more rows of the last row's run will follow; may come without rows.
  bool end_of_run = false;

  size_t rows() const { return time_s.size(); }
};

// One row as the estimator keeps it.
struct SampleRow {
  int run = 0;
  double time_s = 0;
};

// Consecutive rows of the record that have passed the checks, row by row: values (the channels,
// then the streamed inputs; NaN where missing) and noise (standard deviation of each channel's
// sample; 0 where missing).
struct RowBlock {
  std::vector<SampleRow> rows;
  std::vector<double> values;
  std::vector<double> noise;
  int ahead = 0;           // the last so many rows only tell how the inputs go on
  bool run_ended = false;  // no more rows of the last row's run will follow

  int count() const { return static_cast<int>(rows.size()) - ahead; }
};

// Where the samples of a session lie, so that a moved expansion can be propagated over them again:
// in memory now, on disk behind the same interface later. Rows are appended and never changed.
class SampleStore {
 public:
  virtual ~SampleStore() = default;
  virtual int64_t rows() const = 0;
  // All of the block, its mark of an ended run included, or nothing and why. Without rows it only
  // marks the last row's run as ended.
  virtual absl::Status Append(const RowBlock& block) = 0;
  // Rows [first, first + count), which must be there, into the block; none of them is ahead.
  virtual absl::Status Read(int64_t first, int64_t count, RowBlock& block) const = 0;
};

// Rows [first, first + count) and up to `ahead` rows after them, as far as there are any.
absl::Status ReadWithRowsAhead(const SampleStore& store, int64_t first, int64_t count, int ahead,
                               RowBlock& block);

}  // namespace polyest
