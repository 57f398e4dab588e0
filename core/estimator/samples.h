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

  size_t rows() const { return time_s.size(); }
};

// One row as the estimator keeps it.
struct SampleRow {
  int run = 0;
  double time_s = 0;
};

// Where the samples of a session lie, so that a moved expansion can be propagated over them again:
// in memory now, on disk behind the same interface later. Rows are appended and never changed.
class SampleStore {
 public:
  virtual ~SampleStore() = default;
  virtual int64_t rows() const = 0;
  // values: the channels then the streamed inputs, NaN where missing. noise: the standard
  // deviation of each channel, 0 where missing.
  virtual absl::Status Append(const SampleRow& row, const std::vector<double>& values,
                              const std::vector<double>& noise) = 0;
  // Reads rows [first, first + count) column-wise into the vectors given (resized to count,
  // count × values, count × noise).
  virtual absl::Status Read(int64_t first, int64_t count, std::vector<SampleRow>& rows,
                            std::vector<double>& values, std::vector<double>& noise) const = 0;
};

}  // namespace polyest
