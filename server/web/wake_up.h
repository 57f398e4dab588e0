#pragma once

// Lets a thread wait for other threads and for a client's socket at the same time.

#include <chrono>

namespace polyest::internal {

class WakeUp {
 public:
  using Clock = std::chrono::steady_clock;
  enum class Reason {
    kSignal,      // Signal has been called since Clear
    kClientGone,  // the client has closed its connection
    kTimeout,
  };

  // Throws std::system_error if the process has no descriptor left.
  WakeUp();
  ~WakeUp();
  WakeUp(const WakeUp&) = delete;
  WakeUp& operator=(const WakeUp&) = delete;

  // Ends a wait, now or later. May be called by any thread.
  void Signal() const;
  // Forgets the signals.
  void Clear() const;
  // Waits for a signal, at most until `deadline`, and for the end of the client's connection.
  // `client` is its socket; negative: there is no client. May return without a reason: kSignal.
  Reason Await(int client, Clock::time_point deadline) const;
  // Returns whether the client has closed its connection.
  static bool IsGone(int client);

 private:
  const int event_;
};

}  // namespace polyest::internal
