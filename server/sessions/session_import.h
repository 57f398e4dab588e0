#pragma once

// Makes a session out of the records of another: out of all of them, or no session at all.

#include <absl/status/statusor.h>

#include <memory>
#include <string>
#include <vector>

#include "server/sessions/session_registry.h"

namespace polyest::internal {

// For use by one thread at a time.
class SessionImport {
 public:
  SessionImport(SessionRegistry& registry, std::string tenant);
  // Deletes the session if the import has not been finished.
  ~SessionImport();
  SessionImport(const SessionImport&) = delete;
  SessionImport& operator=(const SessionImport&) = delete;

  // Takes the head, then batch after batch, the history and the end; waits for the journal.
  // INVALID_ARGUMENT for a record that does not follow the one before, RESOURCE_EXHAUSTED while
  // memory is short; other errors are those of SessionRegistry::Create and of a batch that is
  // streamed; on a stop request its status. Must not be called again after an error.
  absl::Status Take(const v1::ImportSessionRequest& request, const Stop& stop = {});
  // Makes the session visible and returns it. INVALID_ARGUMENT when the head, batches that it
  // promises, or the end are missing; ALREADY_EXISTS when the name has been taken meanwhile, and
  // RESOURCE_EXHAUSTED when the last place has been.
  absl::StatusOr<std::shared_ptr<Session>> Finish();
  // Returns the number of the session's rows that are in memory: some thousands at most, because
  // the journal has them.
  int64_t rows_in_memory() const { return loaded_ == nullptr ? 0 : loaded_->rows_in_memory(); }

 private:
  absl::Status Begin(const std::string& id, const v1::SessionRecord::Head& head, const Stop& stop);
  // Takes what a head says of the session, but for its problem.
  absl::Status TakeHead(const std::string& id, const v1::SessionRecord::Head& head);
  // Puts the session into the journal, hidden, and loads it.
  absl::Status Store(const v1::Problem& problem, const Stop& stop);
  absl::Status Append(const v1::SessionRecord::Batch& batch);
  absl::Status Remember(const v1::SessionRecord::PastEstimate& past);
  // INVALID_ARGUMENT if records are missing.
  absl::Status TakeEnd();

  SessionRegistry& registry_;
  SessionHead head_;
  int64_t promised_ = 0;  // number of batches that the head promises
  std::unique_ptr<LoadedSession> loaded_;
  std::vector<JournalHistoryPoint> history_;
  bool ended_ = false;  // whether the record of the end has come
};

}  // namespace polyest::internal
