#pragma once

// Identifies the daemon that may change a session in PostgreSQL, and makes the refusals of others.

#include <absl/status/status.h>

#include <cstdint>

#include "server/journal/postgres_connection.h"

namespace polyest::internal {

// Identifies the owner for which a session is changed.
struct PostgresOwner {
  bool operator==(const PostgresOwner&) const = default;

  int64_t node = 0;
  int64_t epoch = 0;
};

// Returns the error when another daemon has become the owner of a session: UNAVAILABLE.
absl::Status TakenOver();
// Returns the error for a batch that does not follow the last one: FAILED_PRECONDITION.
absl::Status DoesNotFollow(int64_t sequence);

// Judges what a statement tells in three flags: whether it has changed something, whether the owner
// was right, and whether the session is there. NOT_FOUND when there is no such session, UNAVAILABLE
// when it has another owner or epoch, FAILED_PRECONDITION when nothing has changed for another
// reason.
absl::Status JudgeOwned(const PostgresResult& result);

}  // namespace polyest::internal
