#pragma once

// Batches that PostgreSQL inserts by one statement. A statement of its own for each would take it
// twice the time: nearly all of it goes into beginning and ending statements.

#include <cstdint>
#include <map>
#include <vector>

#include "server/journal/batch_parts.h"
#include "server/journal/postgres_connection.h"
#include "server/journal/postgres_owner.h"
#include "server/journal/session_journal.h"

namespace polyest::internal {

// What it is given must outlive it.
class PostgresBatches {
 public:
  bool empty() const { return batches_.empty(); }
  // Returns whether a batch can be inserted together with those before it. It follows the last one
  // of its session, if that has one here, and none of them is in parts, since whether all parts are
  // there is found out only while they are inserted.
  bool Take(const JournalEntry& entry, const BatchPart& last, const PostgresOwner& owner) const;
  // Adds a batch; `last` is the last of its parts.
  void Add(const JournalEntry& entry, const BatchPart& last, const PostgresOwner& owner);

  // Returns two statements. The first one locks the rows of the sessions' owners until the
  // transaction ends; who takes a session meanwhile waits for that. The second one inserts the
  // batches that follow the last ones of their sessions where the owners are these: it finds
  // another epoch where the first one has waited for a taking.
  std::vector<PostgresStatement> Statements() const;
  // Returns for each batch whether it was inserted, by what the second statement has given.
  std::vector<bool> Inserted(const PostgresResult& result) const;

  // Returns the statement that tells why a batch was not inserted, and judges what it tells.
  PostgresStatement Why(size_t batch) const;
  absl::Status Judge(size_t batch, const PostgresResult& why) const;

 private:
  struct Batch {
    const JournalEntry* entry;
    BatchPart last;
    PostgresOwner owner;
    int64_t ahead = 0;        // number of batches of the session before it
    int64_t bytes_ahead = 0;  // bytes of their measurements
  };

  const Batch* LastOf(int64_t session) const;
  PostgresStatement Lock() const;
  PostgresStatement Insert() const;

  std::vector<Batch> batches_;
  std::map<int64_t, size_t> last_;  // numbers of the last batches, by session
};

}  // namespace polyest::internal
