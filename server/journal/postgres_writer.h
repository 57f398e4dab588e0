#pragma once

// Commits writes to PostgreSQL in groups: all statements of a group travel in one pipeline, as one
// transaction. Connects again by itself after the connection was lost.

#include <absl/status/status.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "server/journal/postgres_batches.h"
#include "server/journal/postgres_connection.h"
#include "server/journal/postgres_owner.h"

namespace polyest::internal {

// For use by one thread at a time.
class PostgresWriter {
 public:
  // Adds statements with Send. An error means that it has added none.
  using Write = std::function<absl::Status(PostgresWriter&)>;
  // Judges what a statement has given; may refuse only what the statement has left as it was.
  using Judge = std::function<absl::Status(const PostgresResult&)>;

  explicit PostgresWriter(PostgresTarget target) : target_(std::move(target)) {}

  // Adds a statement to the group. What its parameters refer to must live as long as the write.
  void Send(const char* sql, PostgresParameters parameters, Judge judge = {});
  // Adds a batch to the group; `last` is the last of its parts. The entry must live as long as the
  // write. FAILED_PRECONDITION when the batch does not follow the last one, NOT_FOUND when there is
  // no such session, and UNAVAILABLE when it has another owner or epoch.
  void SendBatch(const JournalEntry& entry, const BatchPart& last, const PostgresOwner& owner);

  // Commits the group, as CommitQueue asks of its database. UNAVAILABLE when the database is away;
  // the group may then have been committed all the same, unless its sessions are claimed again
  // (PostgresNode): no transaction can add to them from then on.
  absl::Status Commit(const std::vector<Write>& writes, std::vector<absl::Status>& outcomes);

 private:
  struct Sent {
    std::optional<size_t> write;  // number of the write in the group; nothing: of several ones
    Judge judge;
  };
  // Batches that one statement inserts, and the numbers of their writes.
  struct Together {
    size_t statement = 0;
    PostgresBatches batches;
    std::vector<size_t> writes;
  };

  absl::Status Connect();
  // Lets the writes that have no outcome yet add their statements.
  void Collect(const std::vector<Write>& writes, std::vector<absl::Status>& outcomes);
  // Adds the statements of the batches gathered, so that those of later writes come behind them.
  void SendGathered();
  absl::Status Run(std::vector<absl::Status>& outcomes, bool& again);
  void JudgeBatches(const Together& sent, const PostgresResult& result,
                    std::vector<absl::Status>& outcomes);

  const PostgresTarget target_;
  std::unique_ptr<PostgresConnection> connection_;
  std::chrono::steady_clock::time_point next_attempt_{};  // not before is another one made
  // The group under way.
  size_t write_ = 0;
  std::vector<PostgresStatement> statements_;
  std::vector<Sent> sent_;  // describes each statement but BEGIN and COMMIT
  Together gathered_;       // whose statements are still to be added
  std::vector<Together> together_;
};

}  // namespace polyest::internal
