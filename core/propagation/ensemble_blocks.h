#pragma once

// The blocks that an ensemble is dealt into. They are independent, so that results have the same
// bits for any number of threads. All advance together from one checkpoint to the next, where their
// integrators restart, so that an ensemble can be restored there.

#include <absl/status/status.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/common/parallel.h"
#include "core/common/status.h"
#include "core/propagation/trajectory_ensemble.h"

namespace polyest::internal {

// Block: a TrajectoryBlock, or what has its failures(), Restart, State, Fits and Restore.
template <class Block>
class EnsembleBlocks {
 public:
  EnsembleBlocks(std::vector<std::unique_ptr<Block>> blocks, int threads,
                 int64_t samples_between_checkpoints)
      : blocks_(std::move(blocks)),
        threads_(threads),
        interval_(samples_between_checkpoints),
        statuses_(blocks_.size()) {
    CollectFailures();
  }

  const std::vector<std::unique_ptr<Block>>& blocks() const { return blocks_; }
  // The failures so far, ordered by point.
  const std::vector<PointFailure>& failures() const { return failures_; }

  // Calls `advance(block, first, count)` for each block and for each stretch of the sample times
  // that ends with them or at a checkpoint. Returns the first error of a block.
  template <class Advance>
  absl::Status AdvanceSamples(std::span<const double> times_s, const Advance& advance) {
    for (Eigen::Index first = 0; first < std::ssize(times_s);) {
      if (AtCheckpoint()) {
        for (const auto& block : blocks_) block->Restart();
      }
      const Eigen::Index count =
          std::min<Eigen::Index>(std::ssize(times_s) - first, interval_ - samples_ % interval_);
      POLYEST_RETURN_IF_ERROR(ForEach([&](Block& block) { return advance(block, first, count); }));
      samples_ += count;
      first += count;
      time_s_ = times_s[static_cast<size_t>(first - 1)];
    }
    return absl::OkStatus();
  }

  // Calls `act` for each block, in several threads. Returns the first error of a block.
  template <class Act>
  absl::Status ForEach(const Act& act) {
    ParallelFor(static_cast<int>(blocks_.size()), threads_, [&](int block) {
      const auto index = static_cast<size_t>(block);
      statuses_[index] = act(*blocks_[index]);
    });
    CollectFailures();
    for (const absl::Status& status : statuses_) {
      if (!status.ok()) return status;
    }
    return absl::OkStatus();
  }

  // Updates failures() after something other than the calls above has acted on the blocks.
  void CollectFailures() {
    size_t count = 0;
    for (const auto& block : blocks_) count += block->failures().size();
    if (count == failures_.size()) return;
    failures_.clear();
    for (const auto& block : blocks_) {
      failures_.insert(failures_.end(), block->failures().begin(), block->failures().end());
    }
    std::ranges::sort(failures_, {}, &PointFailure::point);
  }

  // Return what Restore needs to go on from here, and go on from there, as TrajectoryEnsemble's do.
  std::optional<EnsembleState> State() const {
    if (!AtCheckpoint()) return std::nullopt;
    EnsembleState state{.samples = samples_, .time_s = time_s_, .blocks = {}};
    for (const auto& block : blocks_) state.blocks.push_back(block->State());
    return state;
  }
  bool Restore(const EnsembleState& state) {
    bool fits = state.blocks.size() == blocks_.size() && state.samples > 0 &&
                state.samples % interval_ == 0 && std::isfinite(state.time_s) && state.time_s >= 0;
    for (size_t i = 0; fits && i < blocks_.size(); ++i) fits = blocks_[i]->Fits(state.blocks[i]);
    if (!fits) return false;
    for (size_t i = 0; i < blocks_.size(); ++i) blocks_[i]->Restore(state.time_s, state.blocks[i]);
    samples_ = state.samples;
    time_s_ = state.time_s;
    CollectFailures();
    return true;
  }

 private:
  bool AtCheckpoint() const { return samples_ > 0 && samples_ % interval_ == 0; }

  std::vector<std::unique_ptr<Block>> blocks_;
  int threads_;
  int64_t interval_;  // number of samples between two checkpoints
  int64_t samples_ = 0;
  double time_s_ = 0;                   // of the last sample
  std::vector<absl::Status> statuses_;  // one per block
  std::vector<PointFailure> failures_;
};

}  // namespace polyest::internal
