#pragma once

// Ends long work early, on request or at a deadline.

#include <absl/status/status.h>

#include <chrono>
#include <optional>
#include <stop_token>
#include <utility>

namespace polyest {

// Tells long work to end early: on request, for instance because a caller went away, or at a
// deadline. A default-constructed Stop never does. The numerics call Check() between samples and
// between sweeps of a sampler; what was processed before stays valid.
class Stop {
 public:
  // The clock of deadlines: one that is never set back.
  using Clock = std::chrono::steady_clock;

  // Never asks for an end.
  Stop() = default;
  // Asks for an end once a stop of `token`'s source is requested, or once `deadline` has passed;
  // without a deadline, on request only.
  explicit Stop(std::stop_token token, std::optional<Clock::time_point> deadline = std::nullopt)
      : token_(std::move(token)), deadline_(deadline) {}

  // Returns OK, CANCELLED or DEADLINE_EXCEEDED.
  absl::Status Check() const {
    if (token_.stop_requested()) return absl::CancelledError("the request was cancelled");
    if (deadline_ && Clock::now() >= *deadline_) {
      return absl::DeadlineExceededError("the request's deadline has passed");
    }
    return absl::OkStatus();
  }

 private:
  std::stop_token token_;
  std::optional<Clock::time_point> deadline_;
};

}  // namespace polyest
