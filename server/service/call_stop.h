#pragma once

#include <absl/status/status.h>
#include <absl/strings/str_format.h>
#include <grpc/support/time.h>
#include <grpcpp/server_context.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <stop_token>
#include <utility>

#include "polyest/stop.h"
#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {

// Decides when the work of a call stops: at its cancellation, at its deadline, or when a piece of
// the work has been computed for as long as is allowed.
class CallStop {
 public:
  CallStop(const grpc::CallbackServerContext& context, std::stop_token token,
           std::chrono::seconds max_computing)
      : token_(std::move(token)), max_computing_(max_computing) {
    // The deadline is kept by the monotonic clock, because the wall clock may be set meanwhile.
    const gpr_timespec deadline =
        gpr_convert_clock_type(context.raw_deadline(), GPR_CLOCK_MONOTONIC);
    if (gpr_time_cmp(deadline, gpr_inf_future(GPR_CLOCK_MONOTONIC)) == 0) return;
    const gpr_timespec remaining = gpr_time_sub(deadline, gpr_now(GPR_CLOCK_MONOTONIC));
    deadline_ = Stop::Clock::now() + std::chrono::seconds(remaining.tv_sec) +
                std::chrono::nanoseconds(remaining.tv_nsec);
  }

  // Makes a stop for work without a call, and so without a deadline.
  CallStop(std::stop_token token, std::chrono::seconds max_computing)
      : token_(std::move(token)), max_computing_(max_computing) {}

  // Returns the stop of a piece of work that begins now.
  Stop Begin() const {
    const Stop::Clock::time_point limit = Stop::Clock::now() + max_computing_;
    return Stop(token_, deadline_ ? std::min(*deadline_, limit) : limit);
  }

  // Returns the status of such work as the call shall report it: RESOURCE_EXHAUSTED, naming
  // --max-compute-s, for work that was computed too long though the call's deadline has not passed;
  // any other status as it is.
  absl::Status Name(absl::Status status) const {
    const bool in_time = !deadline_ || Stop::Clock::now() < *deadline_;
    if (!absl::IsDeadlineExceeded(status) || !in_time) return status;
    return LimitExceeded(
        "--max-compute-s",
        absl::StrFormat(
            "the request was computed for %d s, the longest that one may be (--max-compute-s)",
            max_computing_.count()));
  }

 private:
  std::stop_token token_;
  std::chrono::seconds max_computing_;
  std::optional<Stop::Clock::time_point> deadline_;
};

}  // namespace polyest::internal
