#pragma once

// Keeps the observers of a session and passes its estimates on to them.

#include <absl/status/status.h>

#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/execution/executor.h"
#include "server/sessions/session_observer.h"

namespace polyest::internal {

// Owned by a shared_ptr, because estimates on their way keep it alive. The executor must outlive
// it. Thread-safe.
class ObserverList : public std::enable_shared_from_this<ObserverList> {
 public:
  // `session` is the name of the session, for messages. Observers are told in `lane`.
  ObserverList(std::string session, Executor& executor, std::string lane)
      : session_(std::move(session)),
        strand_(std::make_shared<Strand>(executor, std::move(lane))) {}

  // Adds an observer. NOT_FOUND once the list is closed.
  absl::Status Add(std::shared_ptr<SessionObserver> observer);
  void Remove(const SessionObserver* observer);
  size_t size() const;
  std::vector<std::shared_ptr<SessionObserver>> All() const;

  // Passes the estimate on to the observers that have neither it nor one of a later batch, soon, on
  // a strand of its own: whoever calls this, the thread that writes for all tenants above all, does
  // not wait for the observers, and neither does an estimate for a long computation. An estimate
  // replaces an older one that still waits.
  void Announce(SharedEstimate estimate);
  // Calls `then` after all estimates announced before have been passed on.
  void AfterAnnounced(std::function<void()> then);
  // Refuses new observers from here on. Returns the observers it had, for the caller to tell them
  // of the end.
  std::vector<std::shared_ptr<SessionObserver>> Close();

 private:
  struct Entry {
    std::shared_ptr<SessionObserver> observer;
    SharedEstimate told;  // the last estimate that it was given, if any
  };

  std::vector<std::shared_ptr<SessionObserver>> AllLocked() const;
  // Passes on what waits; runs on the strand. The observers are called without the lock.
  void PassOn();

  const std::string session_;
  const std::shared_ptr<Strand> strand_;
  mutable std::mutex mutex_;
  bool closed_ = false;
  SharedEstimate waiting_;  // null: no task is on its way
  std::vector<Entry> entries_;
};

}  // namespace polyest::internal
