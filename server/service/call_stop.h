#pragma once

#include <grpcpp/server_context.h>

#include <chrono>
#include <optional>
#include <stop_token>

#include "core/common/stop.h"

namespace polyest {

// The numerics' stop signal for a call: its cancellation and its deadline.
inline Stop CallStop(const grpc::CallbackServerContext& context, std::stop_token token) {
  const auto deadline = context.deadline();
  if (deadline == std::chrono::system_clock::time_point::max()) return Stop(std::move(token));
  const auto remaining = deadline - std::chrono::system_clock::now();
  return Stop(std::move(token),
              Stop::Clock::now() + std::chrono::duration_cast<Stop::Clock::duration>(remaining));
}

}  // namespace polyest
