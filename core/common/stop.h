#pragma once

#include <absl/status/status.h>

#include <chrono>
#include <optional>
#include <stop_token>

namespace polyest {

// When long work should end early: on request (a caller went away) or at a deadline. A
// default-constructed Stop never asks for an end. The numerics poll Check() between samples and
// between sampler sweeps; what was ingested before stays valid.
class Stop {
 public:
  using Clock = std::chrono::steady_clock;

  Stop() = default;
  explicit Stop(std::stop_token token, std::optional<Clock::time_point> deadline = std::nullopt)
      : token_(std::move(token)), deadline_(deadline) {}

  // OK, CANCELLED or DEADLINE_EXCEEDED.
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
