#include "server/telemetry/log_limit.h"

#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

namespace polyest::internal {

std::optional<int64_t> LogLimit::Admit(const std::string& kind, Clock::time_point now) {
  const std::lock_guard lock(mutex_);
  Kind& one = kinds_.try_emplace(kind, Kind{static_cast<double>(burst_), now}).first->second;
  const double passed_s = std::chrono::duration<double>(now - one.since).count();
  one.lines = std::min<double>(burst_, one.lines + a_second_ * passed_s);
  one.since = now;
  if (one.lines < 1) {
    ++one.suppressed;
    return std::nullopt;
  }
  one.lines -= 1;
  return std::exchange(one.suppressed, 0);
}

std::string SuppressedText(int64_t lines) { return lines > 0 ? absl::StrCat(lines) : ""; }

}  // namespace polyest::internal
