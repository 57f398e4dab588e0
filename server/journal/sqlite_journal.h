#pragma once

// Keeps sessions on disk: in one SQLite file in WAL mode, synced at every commit.

#include <atomic>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "server/journal/commit_queue.h"
#include "server/journal/data_folder.h"
#include "server/journal/disk_reserve.h"
#include "server/journal/session_journal.h"
#include "server/journal/session_seals.h"
#include "server/journal/sqlite_database.h"

namespace polyest::internal {

struct SqliteJournalOptions {
  // The journal is `folder`/journal.db. The folder is made if there is none, for its owner only.
  std::string folder;
  // Largest size of that file, MiB; 0: as large as the disk. Past it, writes are
  // RESOURCE_EXHAUSTED.
  int64_t max_mb = 0;
  OnCommit on_commit{};
};

class SqliteJournal final : public SessionJournal {
 public:
  // Opens the journal; makes it if there is none. FAILED_PRECONDITION for what DataFolder::Take
  // refuses, and when the file is no journal or one of a later version; DATA_LOSS when the file is
  // damaged. The file is then as it was.
  static absl::StatusOr<std::unique_ptr<SqliteJournal>> Open(const SqliteJournalOptions& options);
  // Writes everything appended, then ends.
  ~SqliteJournal() override;

  // Returns what Open has found to be damaged or missing, a sentence each.
  const std::vector<std::string>& damage() const { return damage_; }

  bool durable() const override { return true; }
  absl::Status CheckWritable() override;
  absl::StatusOr<std::unique_ptr<JournalBackup>> BackUp(const Stop& stop) override;
  absl::StatusOr<std::vector<SessionHead>> Heads() const override;
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
  static constexpr int64_t kPageBytes = 4'096;

  // Borrows a connection to read with, and gives it back when destroyed.
  class Reader;
  struct KeptBatch {
    int64_t sequence = 0;
    std::string measurements;  // serialized
    std::string digest;
  };

  SqliteJournal(std::unique_ptr<DataFolder> folder, std::unique_ptr<DiskReserve> reserve,
                std::unique_ptr<SqliteDatabase> writer, std::unique_ptr<SqliteDatabase> maintainer,
                std::unique_ptr<SessionSeals> seals, std::vector<std::string> damage,
                const SqliteJournalOptions& options);
  absl::StatusOr<int64_t> LastBatch(int64_t session) const;
  absl::StatusOr<std::vector<KeptBatch>> ReadPage(int64_t session, int64_t after,
                                                  size_t bytes) const;
  absl::StatusOr<std::vector<Seal>> BeginSnapshot(SqliteDatabase& source);
  // Copies the journal into a file that is open as `descriptor`, and verifies the copy.
  absl::StatusOr<JournalContents> CopyTo(const std::string& file, int descriptor, const Stop& stop);
  void SealCommit(bool kept);
  void ReadTenants(SqliteDatabase& database);
  // Returns the lane of the commit queue in which a session is written: its tenant's.
  std::string LaneOf(int64_t session) const;
  // Returns OK if there is room on the disk for more than deletions, else the refusal.
  absl::Status CheckDisk(SqliteDatabase& database);
  bool FreeDisk();
  void Maintain(std::stop_token stop);
  void Checkpoint();
  absl::StatusOr<bool> RemoveSomeDeleted();
  void WakeMaintenance();

  const std::unique_ptr<DataFolder> folder_;
  const std::unique_ptr<DiskReserve> reserve_;
  // Number of pages in the write-ahead log from which on they are copied into the file.
  const int checkpoint_pages_;
  const std::vector<std::string> damage_;
  mutable std::mutex readers_mutex_;
  mutable std::vector<std::unique_ptr<SqliteDatabase>> readers_;

  mutable std::mutex tenants_mutex_;
  std::map<int64_t, std::string> tenants_;  // of the sessions

  const int64_t max_pages_;  // of the file
  bool grows_ = true;        // whether the file may have so many. Used by the writing thread only

  std::unique_ptr<SqliteDatabase> maintainer_;  // connection of the maintenance thread
  std::mutex maintenance_mutex_;
  std::condition_variable_any maintenance_;
  std::atomic<int> log_pages_ = 0;  // pages in the write-ahead log
  bool short_of_disk_ = false;      // whether the log is to be copied, however short it is
  bool deleted_ = true;             // whether there may be batches of deleted sessions

  const std::unique_ptr<SessionSeals> seals_;
  // Seals of the commit under way, null for deleted sessions. Used by the writing thread only.
  std::map<int64_t, std::optional<Seal>> unsealed_;

  // Whether there is a backup. Backups may outlive the journal.
  const std::shared_ptr<std::atomic<bool>> backing_up_ = std::make_shared<std::atomic<bool>>(false);

  std::unique_ptr<CommitQueue<SqliteDatabase>> queue_;
  std::jthread maintenance_thread_;
};

}  // namespace polyest::internal
