#pragma once

// Ends a stream whose client opens it and then says nothing, so that nobody occupies places with
// streams that do nothing.

#include <grpc/support/time.h>
#include <grpcpp/alarm.h>

#include <chrono>
#include <functional>
#include <utility>

#include "core/common/status.h"

namespace polyest::internal {

class FirstMessageTimer {
 public:
  // Calls `expired` after the time, from a thread of gRPC's, unless Stop comes first. Must be
  // called at most once.
  void Start(std::chrono::milliseconds time, std::function<void()> expired) {
    // The monotonic clock, because the wall clock may be set meanwhile.
    const gpr_timespec deadline = gpr_time_add(gpr_now(GPR_CLOCK_MONOTONIC),
                                               gpr_time_from_millis(time.count(), GPR_TIMESPAN));
    alarm_.Set(deadline, [expired = std::move(expired)](bool in_time) {
      if (in_time) expired();
    });
  }
  void Stop() { alarm_.Cancel(); }

 private:
  grpc::Alarm alarm_;
};

// Returns why such a stream ends.
inline absl::Status SaidNothing() {
  return absl::DeadlineExceededError("the first message of the stream did not come in time");
}

}  // namespace polyest::internal
