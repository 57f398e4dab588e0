#include "core/estimator/record/run_inputs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/common/check.h"
#include "core/common/status.h"
#include "core/model/interpolation.h"

namespace polyest::internal {
namespace {

constexpr int64_t kKnotRowsAtOnce = 64;

// Adds the knots up to `time_s` in a block to their numbers, by input.
void CountKnots(const RowBlock& block, double time_s, std::vector<int>& counts) {
  const size_t width = block.width();
  for (size_t row = 0; row < block.rows.size(); ++row) {
    if (block.rows[row].time_s > time_s) break;
    for (size_t i = 0; i < counts.size(); ++i) {
      const double value = block.values[row * width + width - counts.size() + i];
      if (!std::isnan(value)) ++counts[i];
    }
  }
}

}  // namespace

absl::StatusOr<int64_t> RowOfFirstKnots(const ResolvedProblem& problem, const SampleStore& store,
                                        int64_t run_begin, int64_t rows, double time_s) {
  std::vector<int> counts(problem.streamed_inputs().size(), 0);
  const auto few = [](int count) { return count < kKnotsBehind; };
  RowBlock block;
  int64_t first = rows;
  while (first > run_begin && std::ranges::any_of(counts, few)) {
    const int64_t count = std::min(kKnotRowsAtOnce, first - run_begin);
    first -= count;
    POLYEST_RETURN_IF_ERROR(store.Read(first, count, block));
    CountKnots(block, time_s, counts);
  }
  return first;
}

double LargestInputDelay(const EnsembleSpecification& specification) {
  const Matrix& delays_s = specification.input_delays_s;
  return delays_s.size() == 0 ? 0 : std::max(0.0, delays_s.maxCoeff());
}

RunInputs::RunInputs(const ResolvedProblem& problem, const SampleStore* store, int run,
                     int64_t first_row)
    : problem_(problem),
      store_(store),
      run_(run),
      signals_(problem.MakeInputs()),
      next_row_(first_row),
      last_row_s_(-std::numeric_limits<double>::infinity()) {
  POLYEST_CHECK(store != nullptr || problem.streamed_inputs().empty());
}

void RunInputs::Forget(double time_s) {
  for (const int input : problem_.streamed_inputs()) {
    signals_[static_cast<size_t>(input)].Forget(time_s);
  }
}

bool RunInputs::SettledFor(double time_s) const {
  const double needed_s = time_s + problem_.lead_s();
  return std::ranges::all_of(problem_.streamed_inputs(), [&](int input) {
    const InputSignal& signal = signals_[static_cast<size_t>(input)];
    return signal.finished() || (last_row_s_ >= needed_s && signal.SettledUpTo(needed_s));
  });
}

absl::Status RunInputs::ReadUpTo(double time_s) {
  if (problem_.streamed_inputs().empty()) return absl::OkStatus();
  while (!finished_ && !SettledFor(time_s)) {
    if (next_in_block_ == block_.rows.size()) {
      if (next_row_ == store_->rows()) return Finish();
      POLYEST_RETURN_IF_ERROR(ReadNextRows());
    }
    AppendRow(next_in_block_++);
  }
  return absl::OkStatus();
}

absl::Status RunInputs::ReadNextRows() {
  const int64_t count = std::min(kKnotRowsAtOnce, store_->rows() - next_row_);
  POLYEST_RETURN_IF_ERROR(store_->Read(next_row_, count, block_));
  next_in_block_ = 0;
  return absl::OkStatus();
}

// Appends the knots of a row of the block; a row of another run ends this one.
void RunInputs::AppendRow(size_t row) {
  const std::vector<int>& streamed = problem_.streamed_inputs();
  if (block_.rows[row].run != run_) {
    for (const int input : streamed) signals_[static_cast<size_t>(input)].Finish();
    finished_ = true;
    return;
  }
  const size_t width = block_.width();
  const size_t channels = width - streamed.size();
  last_row_s_ = block_.rows[row].time_s;
  for (size_t i = 0; i < streamed.size(); ++i) {
    const double value = block_.values[row * width + channels + i];
    if (std::isnan(value)) continue;
    signals_[static_cast<size_t>(streamed[i])].Append(last_row_s_, value);
  }
  ++next_row_;
}

// Ends the run if the store says that its last row has no followers.
absl::Status RunInputs::Finish() {
  POLYEST_RETURN_IF_ERROR(store_->Read(next_row_ - 1, 1, block_));
  next_in_block_ = block_.rows.size();
  if (!block_.run_ended) return absl::OkStatus();
  for (const int input : problem_.streamed_inputs()) {
    signals_[static_cast<size_t>(input)].Finish();
  }
  finished_ = true;
  return absl::OkStatus();
}

}  // namespace polyest::internal
