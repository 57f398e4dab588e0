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
    const auto remaining = Duration(gpr_time_sub(deadline, gpr_now(GPR_CLOCK_MONOTONIC)));
    if (remaining) deadline_ = Stop::Clock::now() + *remaining;
  }

  // Makes a stop for work without a call, and so without a deadline.
  CallStop(std::stop_token token, std::chrono::seconds max_computing)
      : token_(std::move(token)), max_computing_(max_computing) {}

  // Returns the time that remains until a deadline; nothing if it is longer than any call lasts,
  // because the clock cannot count as far as a client may ask.
  static std::optional<std::chrono::nanoseconds> Duration(const gpr_timespec& remaining) {
    constexpr std::chrono::seconds kLongest = std::chrono::years(10);
    if (remaining.tv_sec > kLongest.count()) return std::nullopt;
    return std::chrono::seconds(remaining.tv_sec) + std::chrono::nanoseconds(remaining.tv_nsec);
  }

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
