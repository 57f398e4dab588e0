#pragma once

#include <absl/status/status.h>
#include <absl/strings/str_format.h>
#include <grpcpp/server_context.h>

#include <algorithm>
#include <chrono>
#include <optional>
#include <stop_token>
#include <utility>

#include "core/common/stop.h"
#include "server/refusal/refusal.h"

namespace polyest {

// When the work of a call stops: at its cancellation, at its deadline, or when a piece of it has
// been computed for as long as one may.
class CallStop {
 public:
  CallStop(const grpc::CallbackServerContext& context, std::stop_token token,
           std::chrono::seconds most_computing)
      : token_(std::move(token)), most_computing_(most_computing) {
    const auto deadline = context.deadline();
    if (deadline == std::chrono::system_clock::time_point::max()) return;
    const auto remaining = deadline - std::chrono::system_clock::now();
    deadline_ = Stop::Clock::now() + std::chrono::duration_cast<Stop::Clock::duration>(remaining);
  }

  // For a piece of work that begins now.
  Stop Begin() const {
    const Stop::Clock::time_point limit = Stop::Clock::now() + most_computing_;
    return Stop(token_, deadline_ ? std::min(*deadline_, limit) : limit);
  }

  // What such work answers, in the call's words.
  absl::Status Name(absl::Status status) const {
    const bool in_time = !deadline_ || Stop::Clock::now() < *deadline_;
    if (!absl::IsDeadlineExceeded(status) || !in_time) return status;
    return LimitExceeded(
        "--max-compute-s",
        absl::StrFormat(
            "the request was computed for %d s, the longest that one may be (--max-compute-s)",
            most_computing_.count()));
  }

 private:
  std::stop_token token_;
  std::chrono::seconds most_computing_;
  std::optional<Stop::Clock::time_point> deadline_;
};

}  // namespace polyest
