#include "core/estimator/record/checkpoints.h"

namespace polyest::internal {

void Checkpoints::Add(const std::vector<SampleRow>& rows) {
  for (const SampleRow& row : rows) {
    if (row.run != run_) {
      if (rows_ - last_ >= interval_) Note(rows_);
      run_ = row.run;
      rows_in_run_ = 0;
    }
    ++rows_;
    ++rows_in_run_;
    if (inside_runs_ && rows_in_run_ % interval_ == 0) Note(rows_);
  }
}

void Checkpoints::Note(int64_t rows) { ahead_.push_back(last_ = rows); }

std::optional<int64_t> Checkpoints::next() const {
  if (ahead_.empty()) return std::nullopt;
  return ahead_.front();
}

void Checkpoints::Pass(int64_t rows) {
  while (!ahead_.empty() && ahead_.front() <= rows) ahead_.pop_front();
}

}  // namespace polyest::internal
