#pragma once

// The rows of a record after which a snapshot can be made, a function of the record alone:
//   every `interval` rows of a run, where models can be restored inside a run;
//   before the first row of a run, once `interval` rows have passed since the checkpoint before.

#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "polyest/samples.h"

namespace polyest::internal {

class Checkpoints {
 public:
  // interval ≥ 1.
  Checkpoints(int64_t interval, bool inside_runs)
      : interval_(interval), inside_runs_(inside_runs) {}

  // The record goes on with these rows.
  void Add(const std::vector<SampleRow>& rows);
  // How many rows come before the next checkpoint, where that is in the record already.
  std::optional<int64_t> next() const;
  // Those up to so many rows are behind.
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
