#pragma once

// Keeps sessions in a PostgreSQL database, which several daemons may share: each session belongs to
// one of them at a time (postgres_node.h).

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/journal/commit_queue.h"
#include "server/journal/postgres_node.h"
#include "server/journal/postgres_nodes.h"
#include "server/journal/postgres_pool.h"
#include "server/journal/postgres_target.h"
#include "server/journal/postgres_writer.h"
#include "server/journal/postgres_writes.h"
#include "server/journal/session_journal.h"

namespace polyest::internal {

struct PostgresJournalOptions {
  std::string uri;
  // Name of this node that it keeps when it starts again, and that no other node has; empty: it has
  // none, and waits after a crash until its earlier lease is over.
  std::string node{};
  OnCommit on_commit{};
};

class PostgresJournal final : public SessionJournal, public SharedJournal {
 public:
  // Opens the journal in a database; makes its tables if there are none. INVALID_ARGUMENT for a bad
  // URI; UNAVAILABLE when the database cannot be reached; FAILED_PRECONDITION as
  // PreparePostgresSchema says. The errors say which of the database's rules is broken, and name no
  // secret.
  static absl::StatusOr<std::unique_ptr<PostgresJournal>> Open(
      const PostgresJournalOptions& options);
  // Writes everything appended, then ends.
  ~PostgresJournal() override;

  // Says at which address clients reach this daemon, and how to count its open streams.
  void Announce(const std::string& address, std::function<int64_t()> streams = nullptr) {
    node_->Announce(address, std::move(streams));
  }

  bool durable() const override { return true; }
  SharedJournal* shared() override { return this; }
  absl::StatusOr<SessionPlace> Claim(int64_t session) override { return node_->Claim(session); }
  void Release(int64_t session) override;
  bool Owns(int64_t session) const override { return node_->Owns(session); }
  absl::StatusOr<std::optional<SessionHead>> HeadOf(const std::string& tenant,
                                                    const std::string& name) const override;
  int64_t node() const override { return node_->number(); }
  absl::StatusOr<std::vector<JournalNode>> Nodes() const override { return ReadNodes(*pool_); }
  absl::Status DrainNode(int64_t node) override { return MarkDraining(*pool_, node); }
  void StartDraining() override { node_->StartDraining(); }
  bool AwaitDraining(std::stop_token stop) override { return node_->AwaitDraining(stop); }
  absl::Status CheckWritable() override;
  absl::StatusOr<std::unique_ptr<JournalBackup>> BackUp(const Stop& stop) override;
  absl::StatusOr<std::vector<SessionHead>> Heads() const override;
  absl::StatusOr<std::vector<SessionHead>> HeadsAfter(const std::string& tenant,
                                                      const std::string& after,
                                                      int64_t count) const override;
  absl::StatusOr<int64_t> Create(const SessionHead& head, const v1::Problem& problem,
                                 bool hidden) override;
  absl::Status Show(int64_t session) override;
  absl::Status Delete(int64_t session) override;
  void Append(JournalEntry entry, Done done) override;
  void SaveSnapshot(int64_t session, JournalSnapshot snapshot) override;
  void SaveHistoryPoint(int64_t session, JournalHistoryPoint point, int64_t stride) override;
  absl::StatusOr<v1::Problem> ReadProblem(int64_t session) const override;
  absl::Status ReadBatches(
      int64_t session, int64_t after,
      const std::function<absl::Status(const JournalBatch&)>& take) const override;
  absl::StatusOr<std::string> ReadDigest(int64_t session, int64_t sequence) const override;
  absl::StatusOr<std::optional<JournalSnapshot>> ReadSnapshot(int64_t session) const override;
  absl::StatusOr<std::vector<JournalHistoryPoint>> ReadHistory(int64_t session) const override;

 private:
  PostgresJournal(std::unique_ptr<PostgresPool> pool, std::unique_ptr<PostgresNode> node,
                  const PostgresTarget& target, OnCommit on_commit);
  // Returns the owner that a write of the session carries from now on, and the queue's lane for it.
  std::pair<PostgresOwner, std::string> HoldOf(int64_t session) const;

  const std::unique_ptr<PostgresPool> pool_;  // for reading and for claims
  const std::unique_ptr<PostgresNode> node_;
  const std::unique_ptr<CommitQueue<PostgresWriter>> queue_;
};

}  // namespace polyest::internal
