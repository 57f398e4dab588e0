#pragma once

// When a stream's client wants an estimate.

#include <absl/status/status.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <chrono>
#include <optional>

#include "core/common/field_error.h"
#include "polyest/v1/session_service.pb.h"

namespace polyest::internal {

class EstimateSchedule {
 public:
  using Clock = std::chrono::steady_clock;
  using Policy = v1::StreamMeasurementsRequest::EstimatePolicy;

  absl::Status Set(const Policy& policy) {
    if (policy.batch_count() < 0) {
      return InvalidField("estimates.batchCount",
                          absl::StrFormat("%d must not be negative", policy.batch_count()));
    }
    // Before the conversion to nanoseconds, which would overflow.
    const int64_t seconds = policy.min_interval().seconds();
    const int32_t nanos = policy.min_interval().nanos();
    if (seconds < 0 || seconds > kLongestIntervalSeconds || nanos < 0 || nanos >= 1'000'000'000) {
      return InvalidField("estimates.minInterval",
                          absl::StrFormat("must lie between 0 and %d s", kLongestIntervalSeconds));
    }
    const auto interval = std::chrono::seconds(seconds) + std::chrono::nanoseconds(nanos);
    every_batches_ = std::max(1, policy.batch_count());
    min_interval_ = interval;
    only_last_ = policy.only_last();
    return absl::OkStatus();
  }

  // Whether the batch that has just been taken is to be followed by an estimate.
  bool Due(Clock::time_point now) {
    ++batches_;
    if (only_last_ || batches_ < every_batches_) return false;
    if (last_ && now - *last_ < min_interval_) return false;
    batches_ = 0;
    last_ = now;
    return true;
  }

 private:
  static constexpr int64_t kLongestIntervalSeconds = 86'400;

  int every_batches_ = 1;
  std::chrono::nanoseconds min_interval_{0};
  bool only_last_ = false;
  int batches_ = 0;  // since the last estimate
  std::optional<Clock::time_point> last_;
};

}  // namespace polyest::internal
