#pragma once

// The rows of a record after which a snapshot can be made. They are a function of the record alone:
//   every `interval` rows of a run, if the model can be restored inside a run;
//   before the first row of a run, if at least `interval` rows have passed since the last
//   checkpoint.

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "polyest/samples.h"

namespace polyest::internal {

class Checkpoints {
 public:
  // Takes an interval ≥ 1.
  Checkpoints(int64_t interval, bool inside_runs)
      : interval_(interval), inside_runs_(inside_runs) {}

  // Appends these rows to the record.
  void Add(const std::vector<SampleRow>& rows);
  // Returns the number of rows before the next checkpoint, if the record already contains it.
  std::optional<int64_t> next() const;
  // Discards the checkpoints up to the first `rows` rows.
  void Pass(int64_t rows);

 private:
  void Note(int64_t rows);

  int64_t interval_;
  bool inside_runs_;
  int run_ = 0;
  int64_t rows_ = 0;
  int64_t rows_in_run_ = 0;
  int64_t last_ = 0;
  std::deque<int64_t> ahead_;
};

}  // namespace polyest::internal
