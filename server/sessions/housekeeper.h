#pragma once

// Takes the estimators of idle sessions out of memory: after a time, and while the daemon has more
// memory than it may have those first that were idle longest.

#include <chrono>
#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <thread>

#include "server/sessions/session_registry.h"

namespace polyest::internal {

struct HousekeepingOptions {
  // An estimator that was not used for so long is unloaded.
  std::chrono::milliseconds idle{std::chrono::minutes(10)};
  // How often it looks at the memory, if that is limited.
  std::chrono::milliseconds memory_pause{std::chrono::seconds(1)};
};

class Housekeeper {
 public:
  // Looks after the registry, which must outlive it, from a thread of its own.
  Housekeeper(SessionRegistry& registry, const HousekeepingOptions& options);

 private:
  void Run(std::stop_token stop);
  void UnloadIdle();
  void MakeRoom();

  SessionRegistry& registry_;
  const HousekeepingOptions options_;
  std::mutex mutex_;
  std::condition_variable_any stopping_;
  std::jthread thread_;
};

}  // namespace polyest::internal
