#include "server/telemetry/log_limit.h"

#include <algorithm>
#include <utility>

namespace polyest::internal {

std::optional<int64_t> LogLimit::Admit(const std::string& kind, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  Kind& one = kinds_.try_emplace(kind, Kind{static_cast<double>(burst_), now}).first->second;
  const double passed_s = std::chrono::duration<double>(now - one.since).count();
  one.room = std::min<double>(burst_, one.room + a_second_ * passed_s);
  one.since = now;
  if (one.room < 1) {
    ++one.suppressed;
    return std::nullopt;
  }
  one.room -= 1;
  return std::exchange(one.suppressed, 0);
}

}  // namespace polyest::internal
