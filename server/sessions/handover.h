#pragma once

// Hands the sessions of this daemon over to others of the same database, one after the other, when
// it is asked to. A session that has been let go is taken by the daemon that is asked for it next,
// which goes on to the same bits.

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <stop_token>
#include <thread>

#include "server/sessions/session_registry.h"

namespace polyest::internal {

class Handover {
 public:
  using Clock = std::chrono::steady_clock;

  // Starts a thread that waits until the daemon is asked, calls `on_begin` and hands the sessions
  // over. The registry, whose journal must be shared, must outlive this.
  Handover(SessionRegistry& registry, std::function<void()> on_begin);

  // Ends the thread.
  void Stop();
  // Lets go of all sessions whose streams have ended, until the deadline. To be called after Stop.
  void LetGo(Clock::time_point deadline);

 private:
  void Run(std::stop_token stop);
  // Lets go of a session that nobody streams to or watches; waits for it until the deadline.
  void LetGo(const std::shared_ptr<Session>& session, Clock::time_point deadline);

  SessionRegistry& registry_;
  SharedJournal& journal_;
  const std::function<void()> on_begin_;
  std::mutex mutex_;
  std::condition_variable_any stopping_;
  std::jthread thread_;
};

}  // namespace polyest::internal
