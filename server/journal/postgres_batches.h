#pragma once

// Adds batches to sessions in PostgreSQL. One statement looks first, for all batches of a
// transaction together, who owns their sessions and what these have, and locks the owners' rows;
// nothing can then change until the transaction ends. What does not follow is refused here, and the
// rest is inserted without conditions, which would cost the database more than the inserting.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <map>

#include "server/journal/batch_parts.h"
#include "server/journal/postgres_connection.h"
#include "server/journal/postgres_owner.h"
#include "server/journal/session_journal.h"

namespace polyest::internal {

// A batch for a session; `last` is the last of its parts. What it refers to must live as long as
// the statements.
struct PostgresBatch {
  const JournalEntry* entry;
  BatchPart last;
  PostgresOwner owner;
};

// The sessions to which a transaction adds batches.
class PostgresBatches {
 public:
  bool empty() const { return sessions_.empty(); }
  void Add(const PostgresBatch& batch);

  // Returns the statement that looks at the sessions. It must run first in the transaction. A
  // daemon that takes a session over meanwhile waits for the end of the transaction; where this
  // statement has waited for such a daemon, it finds another epoch.
  PostgresStatement Look() const;
  // Takes what that statement has given.
  void Found(const PostgresResult& result);

  // Returns the statement that inserts a batch, in the order of the batches. NOT_FOUND when there
  // is no such session, UNAVAILABLE when it has another owner or epoch, FAILED_PRECONDITION when
  // the batch does not follow the last one.
  absl::StatusOr<PostgresStatement> Insert(const PostgresBatch& batch);
  // Judges what that statement has given: FAILED_PRECONDITION when parts of the batch are missing.
  static absl::Status JudgeInsert(const PostgresBatch& batch, const PostgresResult& result);
  // Must be called when the transaction deletes a session for an owner: if that is the right one,
  // the session has no more batches.
  void Delete(int64_t session, const PostgresOwner& owner);

 private:
  struct Session {
    PostgresOwner owner;
    bool held = false;  // whether it has that owner
    bool exists = false;
    int64_t sequence = 0;   // of its last batch
    int64_t bytes = 0;      // of the measurements up to that
    bool in_parts = false;  // whether the transaction adds a batch in parts to it
  };

  std::map<int64_t, Session> sessions_;  // by their numbers
};

}  // namespace polyest::internal
