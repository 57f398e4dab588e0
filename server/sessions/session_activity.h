#pragma once

// Counts what a session has done since the daemon started, for those who run the daemon.

#include <chrono>
#include <cstdint>
#include <mutex>
#include <optional>

namespace polyest::internal {

// Thread-safe.
class SessionActivity {
 public:
  using Clock = std::chrono::steady_clock;

  // Notes that the estimator came into memory with the batches up to `sequence`, which span
  // `measured_s` seconds of measurements, or that it left memory.
  void OnLoaded(int64_t sequence, double measured_s);
  void OnUnloaded();
  // Notes that a computation begins, during which the session is in use.
  void OnComputing();
  // Notes its end, and its duration, after which the estimator has processed the batches and
  // the seconds of measurements given.
  void OnComputed(Clock::duration spent, int64_t sequence, double measured_s);
  // Notes an estimate after `reexpansions` re-expansions of the session in all. Returns how many of
  // them are new since the estimate before.
  int64_t OnEstimate(int64_t reexpansions);
  // Notes that a user of the session has left, so that its idle time starts again.
  void OnUsed();

  bool computing() const;
  // Returns the time since the session was last used or computed.
  Clock::duration idle() const;

  struct Summary {
    int64_t estimates = 0;
    int64_t reexpansions = 0;         // that the latest estimate needed
    double compute_s = 0;             // computed in all
    std::optional<int64_t> sequence;  // of the last batch processed; none while not in memory
    // Seconds of measurements ÷ seconds computed for them, since the estimator is in memory; 0
    // before anything is computed.
    double real_time_factor = 0;
  };
  Summary Summarize() const;

 private:
  mutable std::mutex mutex_;
  bool computing_ = false;
  int64_t estimates_ = 0;
  int64_t reexpansions_ = 0;
  double compute_s_ = 0;
  std::optional<int64_t> processed_;  // as of Summary::sequence
  // Seconds of measurements processed, and computed for them, since the estimator is in memory.
  double measured_s_ = 0;
  double computed_s_ = 0;
  double measured_before_s_ = 0;  // seconds of measurements processed before that
  Clock::time_point last_use_ = Clock::now();
};

}  // namespace polyest::internal
