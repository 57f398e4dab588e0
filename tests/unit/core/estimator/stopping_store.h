#pragma once

#include <cstdint>
#include <stop_token>

#include "core/estimator/record/memory_store.h"
#include "polyest/stop.h"

namespace polyest::internal {

// Requests a stop when it has been read a number of times. Work then stops wherever the estimator
// looks next, in the middle of a block, a replay or a re-expansion.
class StoppingStore final : public SampleStore {
 public:
  int64_t rows() const override { return samples_.rows(); }
  absl::Status Append(const RowBlock& block) override { return samples_.Append(block); }
  absl::Status Read(int64_t first, int64_t count, RowBlock& block) const override {
    if (--reads_left_ == 0) source_.request_stop();
    return samples_.Read(first, count, block);
  }
  Stop StopAfter(int reads) {
    source_ = std::stop_source();
    reads_left_ = reads;
    return Stop(source_.get_token());
  }

 private:
  MemoryStore samples_;
  mutable std::stop_source source_;
  mutable int reads_left_ = 0;
};

}  // namespace polyest::internal
