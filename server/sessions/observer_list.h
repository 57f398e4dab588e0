#pragma once

// Keeps the observers of a session.

#include <absl/status/status.h>

#include <cstddef>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/sessions/session_observer.h"

namespace polyest::internal {

// Thread-safe.
class ObserverList {
 public:
  // `session` is the name of the session, for messages.
  explicit ObserverList(std::string session) : session_(std::move(session)) {}

  // Adds an observer. NOT_FOUND once the list is closed.
  absl::Status Add(std::shared_ptr<SessionObserver> observer);
  void Remove(const SessionObserver* observer);
  size_t size() const;
  std::vector<std::shared_ptr<SessionObserver>> All() const;

  // Passes the estimate to all observers, one after the other, without holding the lock.
  void OnEstimate(const SharedEstimate& estimate) const;
  // Refuses new observers from here on. Returns the observers it had, for the caller to tell them
  // of the end.
  std::vector<std::shared_ptr<SessionObserver>> Close();

 private:
  const std::string session_;
  mutable std::mutex mutex_;
  bool closed_ = false;
  std::vector<std::shared_ptr<SessionObserver>> observers_;
};

}  // namespace polyest::internal
