#pragma once

// A session out of the records of another: all of them or none.

#include <absl/status/statusor.h>

#include <memory>
#include <string>

#include "server/sessions/session_registry.h"

namespace polyest::internal {

// For one thread at a time.
class SessionImport {
 public:
  SessionImport(SessionRegistry& registry, std::string tenant);
  // What was not finished is forgotten.
  ~SessionImport();
  SessionImport(const SessionImport&) = delete;
  SessionImport& operator=(const SessionImport&) = delete;

  // The head, then batch after batch. INVALID_ARGUMENT for a record that does not follow the one
  // before; otherwise as SessionRegistry::Create and as for a batch that is streamed. No more
  // records are taken after one has failed.
  absl::Status Take(const v1::ImportSessionRequest& request);
  // INVALID_ARGUMENT when the head, or batches of those it promises, are missing.
  absl::StatusOr<std::shared_ptr<Session>> Finish();

 private:
  absl::Status Begin(const std::string& id, const v1::SessionRecord::Head& head);
  absl::Status Append(const v1::SessionRecord::Batch& batch);

  SessionRegistry& registry_;
  SessionHead head_;
  int64_t promised_ = 0;  // batches
  std::unique_ptr<LoadedSession> loaded_;
};

}  // namespace polyest::internal
