#pragma once

// Who changes a session in PostgreSQL, and what statements tell of it: three flags, whether they
// have changed something, whether the owner was right, and whether the session is there.

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

// Judges the flags: NOT_FOUND when there is no such session, UNAVAILABLE when it has another owner
// or epoch, FAILED_PRECONDITION when nothing has changed for another reason.
absl::Status JudgeOwned(const PostgresResult& result);

// Judges the flags of a statement that adds to a batch, in the same way.
absl::Status JudgeBatch(const PostgresResult& result, int64_t sequence);

}  // namespace polyest::internal
