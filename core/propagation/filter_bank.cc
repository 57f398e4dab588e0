#include "core/propagation/filter_bank.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/common/check.h"
#include "core/common/parallel.h"
#include "core/common/status.h"
#include "core/propagation/linear_system.h"

namespace polyest::internal {

FilterBank::FilterBank(EnsembleSpecification specification, const InputSignals* inputs)
    : specification_(std::move(specification)) {
  const Eigen::Index states = std::ssize(specification_.model->description().states);
  POLYEST_CHECK(states > 0);
  Matrix& process_noise = specification_.process_noise;
  if (process_noise.size() == 0) process_noise.setZero(members(), states);
  POLYEST_CHECK(process_noise.rows() == members() && process_noise.cols() == states);
  POLYEST_CHECK(specification_.output_delays_s.size() == 0);
  const bool exact = StepsExactly(specification_, *inputs);
  const int most = FilterBlock::Members(states);
  for (int first = 0; first < members(); first += most) {
    const int count = std::min(most, members() - first);
    blocks_.push_back(std::make_unique<FilterBlock>(specification_, inputs, first, count, exact));
  }
  statuses_.resize(blocks_.size());
  CollectFailures();
}

absl::Status FilterBank::Advance(const FilterSamples& samples, MatrixRef innovations,
                                 MatrixRef log_variances, const Stop& stop) {
  const Eigen::Index m = samples.values.rows();
  const Eigen::Index times = std::ssize(samples.times_s);
  POLYEST_CHECK(m == std::ssize(specification_.outputs) && samples.values.cols() == times);
  POLYEST_CHECK(samples.noise.rows() == m && samples.noise.cols() == times);
  POLYEST_CHECK(innovations.rows() == members() && innovations.cols() == m * times);
  POLYEST_CHECK(log_variances.rows() == members() && log_variances.cols() == m * times);
  const int64_t interval = specification_.integration.samples_between_checkpoints;
  for (Eigen::Index first = 0; first < times;) {
    if (AtCheckpoint()) {
      for (const auto& block : blocks_) block->Restart();
    }
    const auto count =
        static_cast<Eigen::Index>(std::min<int64_t>(times - first, interval - samples_ % interval));
    const FilterSamples stretch{
        samples.times_s.subspan(static_cast<size_t>(first), static_cast<size_t>(count)),
        samples.values.middleCols(first, count), samples.noise.middleCols(first, count)};
    POLYEST_RETURN_IF_ERROR(AdvanceBlocks(stretch, innovations.middleCols(first * m, count * m),
                                          log_variances.middleCols(first * m, count * m), stop));
    samples_ += count;
    time_s_ = stretch.times_s.back();
    first += count;
  }
  return absl::OkStatus();
}

absl::Status FilterBank::AdvanceBlocks(const FilterSamples& samples, MatrixRef innovations,
                                       MatrixRef log_variances, const Stop& stop) {
  ParallelFor(static_cast<int>(blocks_.size()), specification_.threads, [&](int block) {
    const auto index = static_cast<size_t>(block);
    statuses_[index] = blocks_[index]->Advance(samples, innovations, log_variances, stop);
  });
  CollectFailures();
  for (const absl::Status& status : statuses_) {
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

absl::Status FilterBank::Predict(double time_s, MatrixRef means, MatrixRef deviations,
                                 const Stop& stop) {
  ParallelFor(static_cast<int>(blocks_.size()), specification_.threads, [&](int block) {
    const auto index = static_cast<size_t>(block);
    statuses_[index] = blocks_[index]->PredictOutputs(time_s, means, deviations, stop);
  });
  CollectFailures();
  time_s_ = time_s;
  for (const absl::Status& status : statuses_) {
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

void FilterBank::TakeStatesOf(const FilterBank& other) {
  POLYEST_CHECK(other.blocks_.size() == blocks_.size());
  for (size_t i = 0; i < blocks_.size(); ++i) blocks_[i]->TakeStatesOf(*other.blocks_[i]);
  CollectFailures();
}

void FilterBank::ReadStates(Matrix& means, Matrix& deviations) const {
  means.resize(members(), specification_.process_noise.cols());
  deviations.resizeLike(means);
  Eigen::Index row = 0;
  for (const auto& block : blocks_) {
    const GaussianStates& states = block->states();
    means.middleRows(row, states.members()) = states.mean().matrix();
    deviations.middleRows(row, states.members()) = states.Deviations().matrix();
    row += states.members();
  }
}

bool FilterBank::AtCheckpoint() const {
  return samples_ > 0 && samples_ % specification_.integration.samples_between_checkpoints == 0;
}

std::optional<EnsembleState> FilterBank::State() const {
  if (!AtCheckpoint()) return std::nullopt;
  EnsembleState state{.samples = samples_, .time_s = time_s_, .blocks = {}};
  for (const auto& block : blocks_) state.blocks.push_back(block->State());
  return state;
}

bool FilterBank::Restore(const EnsembleState& state) {
  bool fits = state.blocks.size() == blocks_.size() && state.samples > 0 &&
              state.samples % specification_.integration.samples_between_checkpoints == 0 &&
              std::isfinite(state.time_s) && state.time_s >= 0;
  for (size_t i = 0; fits && i < blocks_.size(); ++i) fits = blocks_[i]->Fits(state.blocks[i]);
  if (!fits) return false;
  for (size_t i = 0; i < blocks_.size(); ++i) blocks_[i]->Restore(state.time_s, state.blocks[i]);
  samples_ = state.samples;
  time_s_ = state.time_s;
  CollectFailures();
  return true;
}

void FilterBank::CollectFailures() {
  failures_.clear();
  for (const auto& block : blocks_) {
    failures_.insert(failures_.end(), block->failures().begin(), block->failures().end());
  }
  std::ranges::sort(failures_, {}, &PointFailure::point);
}

}  // namespace polyest::internal
