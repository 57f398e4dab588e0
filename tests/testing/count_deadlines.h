#pragma once

// Replaces the clock of deadlines by one that counts how often it is asked, so that a deadline is
// the number of a question. It applies to the whole program. To be included in one file of a
// program.

#include <atomic>
#include <chrono>
#include <cstdint>

#include "polyest/stop.h"

namespace polyest::internal {
namespace {

std::atomic<int64_t> times_asked = 0;

// Returns a stop that asks for an end from that question on.
Stop StopAt(int64_t question) {
  return Stop(std::stop_token(), Stop::Clock::time_point(Stop::Clock::duration(question)));
}

}  // namespace
}  // namespace polyest::internal

namespace std::chrono {
inline namespace _V2 {

steady_clock::time_point steady_clock::now() noexcept {
  return time_point(duration(++polyest::internal::times_asked));
}

}  // namespace _V2
}  // namespace std::chrono
