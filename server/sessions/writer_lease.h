#pragma once

// Holds the lease of a session's single writer.

#include <absl/status/status.h>

#include <memory>
#include <mutex>
#include <string>

#include "server/sessions/session_observer.h"

namespace polyest::internal {

// Thread-safe.
class WriterLease {
 public:
  // `session` is the name of the session, for messages.
  explicit WriterLease(std::string session) : session_(std::move(session)) {}

  // Gives the lease to a writer. ABORTED (kAnotherWriter) while another writer holds it, unless
  // both have the same id and it is not empty: then the earlier one is told that it is replaced.
  // NOT_FOUND once the lease is closed.
  absl::Status Claim(std::shared_ptr<SessionObserver> writer, const std::string& id);
  // Takes the lease back from a writer. Returns false if this writer does not hold it (any more).
  bool Release(const SessionObserver* writer);
  bool is_held() const;
  // Returns the writer; null if there is none.
  std::shared_ptr<SessionObserver> writer() const;

  // Refuses every claim from here on. Returns the writer, for the caller to tell it of the end;
  // null if there is none.
  std::shared_ptr<SessionObserver> Close();

 private:
  const std::string session_;
  mutable std::mutex mutex_;
  bool closed_ = false;
  std::shared_ptr<SessionObserver> writer_;
  std::string id_;
};

}  // namespace polyest::internal
