#pragma once

// Limits how many lines a second the log gets of one kind, so that those who are refused cannot
// fill the disk or hide what else happens.

#include <chrono>
#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>

namespace polyest::internal {

// Thread-safe.
class LogLimit {
 public:
  using Clock = std::chrono::steady_clock;

  // Allows `burst` ≥ 1 lines of a kind at once, and `a_second` > 0 more of them each second.
  LogLimit(int burst, double a_second) : burst_(burst), a_second_(a_second) {}

  // Returns whether a line of this kind may be logged now, and if so, how many of its kind were not
  // since the last one. There must be few kinds, and `now` must not decrease.
  std::optional<int64_t> Admit(const std::string& kind, Clock::time_point now = Clock::now());

 private:
  struct Kind {
    double lines = 0;  // that may be logged at once
    Clock::time_point since;
    int64_t suppressed = 0;
  };

  const int burst_;
  const double a_second_;
  std::mutex mutex_;
  std::map<std::string, Kind> kinds_;
};

// Returns a number of lines that were not logged as a field of the next one; empty for none.
std::string SuppressedText(int64_t lines);

}  // namespace polyest::internal
