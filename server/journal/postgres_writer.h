#pragma once

// Commits writes to PostgreSQL in groups: the statements of a group travel in one pipeline, as one
// transaction; where it has batches, a look at their sessions goes ahead. Connects again by itself
// after the connection was lost.

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
  // Adds a batch to the group. FAILED_PRECONDITION when it does not follow the last one, NOT_FOUND
  // when there is no such session, and UNAVAILABLE when it has another owner or epoch.
  void SendBatch(const PostgresBatch& batch);
  // Must be called after a statement that deletes a session for an owner.
  void EndBatches(int64_t session, const PostgresOwner& owner);

  // Commits the group, as CommitQueue asks of its database. UNAVAILABLE when the database is away;
  // the group may then have been committed all the same, unless its sessions are claimed again
  // (PostgresNode): no transaction can add to them from then on.
  absl::Status Commit(const std::vector<Write>& writes, std::vector<absl::Status>& outcomes);

 private:
  // Is a statement, a batch, or the end of a session's batches, which a write has added to the
  // group.
  struct Sent {
    size_t write = 0;  // number of the write in the group
    PostgresStatement statement{};
    Judge judge{};
    std::optional<PostgresBatch> batch{};
    std::optional<int64_t> ended{};
    PostgresOwner owner{};  // for whom it ends
  };

  absl::Status Connect();
  // Lets the writes that have no outcome yet add their statements.
  void Collect(const std::vector<Write>& writes, std::vector<absl::Status>& outcomes);
  absl::Status Run(std::vector<absl::Status>& outcomes, bool& again);
  // Begins the transaction and looks at the sessions of its batches.
  absl::Status Begin();
  // Returns the statements of the transaction but BEGIN, and sets `sent` to the number in sent_ of
  // each but COMMIT. Judges the batches that cannot be added.
  std::vector<PostgresStatement> Statements(std::vector<absl::Status>& outcomes,
                                            std::vector<size_t>& sent);

  const PostgresTarget target_;
  std::unique_ptr<PostgresConnection> connection_;
  std::chrono::steady_clock::time_point next_attempt_{};  // not before is another one made
  // The group under way.
  size_t write_ = 0;
  std::vector<Sent> sent_;
  PostgresBatches batches_;
};

}  // namespace polyest::internal
