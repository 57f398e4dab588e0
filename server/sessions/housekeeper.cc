#include "server/sessions/housekeeper.h"

#include <malloc.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

namespace polyest::internal {
namespace {

// Number of looks within the time after which a session is idle.
constexpr int kLooks = 10;
constexpr std::chrono::milliseconds kShortestPause{10};
// A look that finds the memory full unloads one in this many of the idle sessions in memory.
constexpr size_t kLeaving = 4;

// Unloads a session on its strand, unless it has been used since it was found idle for that time. A
// busy daemon refuses the task; the next look then tries again.
void Unload(const std::shared_ptr<Session>& session, Session::Clock::duration idle) {
  session->strand().Submit([session, idle] { session->Unload(idle); }).IgnoreError();
}

}  // namespace

Housekeeper::Housekeeper(SessionRegistry& registry, const HousekeepingOptions& options)
    : registry_(registry),
      options_(options),
      thread_([this](std::stop_token stop) { Run(stop); }) {}

void Housekeeper::Run(std::stop_token stop) {
  auto pause = std::max(kShortestPause, std::min(options_.idle / kLooks, options_.trim));
  if (registry_.shared()) pause = std::min(pause, options_.follow);
  if (registry_.services().memory.limited()) pause = std::min(pause, options_.memory_pause);
  std::unique_lock lock(mutex_);
  while (!stopping_.wait_for(lock, stop, pause, [&] { return stop.stop_requested(); })) {
    UnloadIdle();
    if (registry_.services().memory.Exceeded()) MakeRoom();
    const auto now = std::chrono::steady_clock::now();
    if (now - trimmed_ >= options_.trim) Trim();
    if (now - followed_ >= options_.follow) FollowOthers(stop);
  }
}

void Housekeeper::UnloadIdle() {
  for (const auto& session : registry_.All()) {
    const auto idle = session->IdleTime();
    if (!session->loaded() || !idle || *idle < options_.idle) continue;
    Unload(session, *idle);
  }
}

void Housekeeper::MakeRoom() {
  std::vector<std::pair<Session::Clock::duration, std::shared_ptr<Session>>> idle;
  for (auto& session : registry_.All()) {
    const auto time = session->IdleTime();
    if (session->loaded() && time) idle.emplace_back(*time, std::move(session));
  }
  std::sort(idle.begin(), idle.end(), std::greater<>());
  idle.resize((idle.size() + kLeaving - 1) / kLeaving);
  for (const auto& [time, session] : idle) Unload(session, time);
  // The sessions that were unloaded since the last look have freed theirs.
  Trim();
}

void Housekeeper::FollowOthers(std::stop_token stop) {
  registry_.FollowOthers(std::move(stop));
  followed_ = std::chrono::steady_clock::now();
}

// The allocator would keep what was freed between blocks that are still in use.
void Housekeeper::Trim() {
  malloc_trim(0);
  trimmed_ = std::chrono::steady_clock::now();
}

}  // namespace polyest::internal
