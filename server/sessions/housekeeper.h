#pragma once

// Unloads the estimators of idle sessions: after a time, and, while the daemon uses more memory
// than it may, those first that have been idle longest. Returns memory that was freed to the
// operating system, and counts what other daemons of the same database have stored, now and then.

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <thread>

#include "server/sessions/session_registry.h"

namespace polyest::internal {

struct HousekeepingOptions {
  // Idle time after which an estimator is unloaded.
  std::chrono::milliseconds idle{std::chrono::minutes(5)};
  // Time between two returns of memory that was freed.
  std::chrono::milliseconds trim{std::chrono::seconds(30)};
  // Time between two looks at what others have stored in a journal that several daemons share.
  std::chrono::milliseconds follow{std::chrono::seconds(5)};
  // Longest time between two looks at the memory, if that is limited.
  std::chrono::milliseconds memory_pause{std::chrono::seconds(1)};
};

class Housekeeper {
 public:
  // Starts a thread that looks after the registry, which must outlive the housekeeper.
  Housekeeper(SessionRegistry& registry, const HousekeepingOptions& options);

 private:
  void Run(std::stop_token stop);
  void UnloadIdle();
  void MakeRoom();
  void Trim();
  void FollowOthers(std::stop_token stop);

  SessionRegistry& registry_;
  const HousekeepingOptions options_;
  std::chrono::steady_clock::time_point trimmed_ = std::chrono::steady_clock::now();
  std::chrono::steady_clock::time_point followed_ = trimmed_;
  std::mutex mutex_;
  std::condition_variable_any stopping_;
  std::jthread thread_;
};

}  // namespace polyest::internal
