#pragma once

// Decides after which batches a stream's client gets an estimate.

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

  // Sets the policy that the client asks for; INVALID_ARGUMENT for a number out of range.
  absl::Status Set(const Policy& policy) {
    if (policy.batch_count() < 0) {
      return InvalidField("estimates.batchCount",
                          absl::StrFormat("%d must not be negative", policy.batch_count()));
    }
    const double interval_s = policy.min_interval_s();
    if (!(interval_s >= 0 && interval_s <= kMaxIntervalS)) {
      return InvalidField("estimates.minIntervalS",
                          absl::StrFormat("%g must be from 0 to %g", interval_s, kMaxIntervalS));
    }
    every_batches_ = std::max(1, policy.batch_count());
    min_interval_ = std::chrono::duration_cast<std::chrono::nanoseconds>(
        std::chrono::duration<double>(interval_s));
    only_last_ = policy.only_last();
    return absl::OkStatus();
  }

  // Counts the batch that has just been taken. Returns whether an estimate is to follow it.
  bool Due(Clock::time_point now) {
    ++batches_;
    if (only_last_ || batches_ < every_batches_) return false;
    if (last_ && now - *last_ < min_interval_) return false;
    batches_ = 0;
    last_ = now;
    return true;
  }

 private:
  static constexpr double kMaxIntervalS = 86'400;

  int every_batches_ = 1;
  std::chrono::nanoseconds min_interval_{0};
  bool only_last_ = false;
  int batches_ = 0;  // since the last estimate
  std::optional<Clock::time_point> last_;
};

}  // namespace polyest::internal
