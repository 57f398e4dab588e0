#include "server/sessions/housekeeper.h"

#include <algorithm>

namespace polyest {
namespace {

// How often it looks, as a part of the time after which a session is idle.
constexpr int kLooks = 4;
constexpr std::chrono::milliseconds kShortestPause{10};

}  // namespace

Housekeeper::Housekeeper(SessionRegistry& registry, const HousekeepingOptions& options)
    : registry_(registry),
      options_(options),
      thread_([this](std::stop_token stop) { Run(stop); }) {}

void Housekeeper::Run(std::stop_token stop) {
  const auto pause = std::max(kShortestPause, options_.idle / kLooks);
  std::unique_lock lock(mutex_);
  while (!stopping_.wait_for(lock, stop, pause, [&] { return stop.stop_requested(); })) {
    UnloadIdle();
  }
}

void Housekeeper::UnloadIdle() {
  for (const auto& session : registry_.All()) {
    const auto idle = session->IdleTime();
    if (!session->loaded() || !idle || *idle < options_.idle) continue;
    // Refused when the daemon is busy: then the next look does it.
    session->strand().Submit([session] { session->Unload(); }).IgnoreError();
  }
}

}  // namespace polyest
