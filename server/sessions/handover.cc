#include "server/sessions/handover.h"

#include <future>
#include <utility>

#include "server/telemetry/structured_log.h"

namespace polyest::internal {
namespace {

// Time after which a session that is in use is looked at again.
constexpr std::chrono::milliseconds kPause{100};
// Longest time for which one session holds up the others.
constexpr std::chrono::seconds kTurn{2};

}  // namespace

Handover::Handover(SessionRegistry& registry, std::function<void()> on_begin)
    : registry_(registry),
      journal_(*registry.services().journal.shared()),
      on_begin_(std::move(on_begin)),
      thread_([this](std::stop_token stop) { Run(stop); }) {}

void Handover::Stop() { thread_ = {}; }

void Handover::Run(std::stop_token stop) {
  if (!journal_.AwaitDraining(stop)) return;
  Log(spdlog::level::info, "handing the sessions over", {});
  on_begin_();
  std::unique_lock lock(mutex_);
  do {
    for (const auto& session : registry_.All()) {
      if (stop.stop_requested()) return;
      if (!journal_.Owns(session->number())) continue;
      session->SendAway();
      LetGo(session, Clock::now() + kTurn);
    }
  } while (!stopping_.wait_for(lock, stop, kPause, [&] { return stop.stop_requested(); }));
}

void Handover::LetGo(Clock::time_point deadline) {
  for (const auto& session : registry_.All()) {
    if (Clock::now() >= deadline) return;
    if (journal_.Owns(session->number())) LetGo(session, deadline);
  }
}

void Handover::LetGo(const std::shared_ptr<Session>& session, Clock::time_point deadline) {
  const auto done = std::make_shared<std::promise<void>>();
  const absl::Status accepted = session->strand().Submit([session, done] {
    session->Unload();
    done->set_value();
  });
  if (accepted.ok()) done->get_future().wait_until(deadline);
}

}  // namespace polyest::internal
