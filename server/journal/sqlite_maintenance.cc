// The maintenance of the journal's file, on a thread of its own (sqlite_journal.h).

#include <absl/strings/str_cat.h>
#include <spdlog/spdlog.h>
#include <sqlite3.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "core/common/status.h"
#include "server/journal/sqlite_journal.h"
#include "server/journal/sqlite_parts.h"
#include "server/journal/sqlite_writes.h"

namespace polyest::internal {
namespace {

// Largest number of batches of a deleted session, and of their bytes, that one commit removes: it
// writes as much as it removes, and others wait for it.
constexpr int64_t kRemovedBatches = 256;
constexpr int64_t kRemovedBytes = CommitQueue<SqliteDatabase>::kMaxBytes;
// Share of the reserve on the disk that this commit may need: Debian's SQLite writes zeros over
// what it removes.
constexpr int64_t kRemovalShare = 8;
// Pages of the write-ahead log that the writer may wait for, and those beyond which it must,
// because the log could otherwise grow without end.
constexpr int kShortRest = 256;
constexpr int kLongLog = 100'000;

// Removes some batches of a session. Returns false when it has none left.
absl::StatusOr<bool> RemoveSomeBatches(SqliteDatabase& database, int64_t session,
                                       int64_t max_bytes) {
  std::vector<int64_t> batches;
  {
    SqliteQuery query(database,
                      "SELECT rowid, length(measurements) FROM batch WHERE session = ? LIMIT ?");
    query.Bind(session).Bind(kRemovedBatches);
    POLYEST_ASSIGN_OR_RETURN(batches, FirstRows(query, max_bytes));
  }
  return RunForRows(database, "DELETE FROM batch WHERE rowid = ?", batches);
}

}  // namespace

void SqliteJournal::WakeMaintenance() {
  const std::lock_guard lock(maintenance_mutex_);
  maintenance_.notify_one();
}

void SqliteJournal::Maintain(std::stop_token stop) {
  bool removing = true, short_of_disk = false;
  while (!stop.stop_requested()) {
    {
      std::unique_lock lock(maintenance_mutex_);
      if (!removing) {
        maintenance_.wait(lock, stop, [this] {
          return log_pages_ >= checkpoint_pages_ || deleted_ || short_of_disk_;
        });
      }
      short_of_disk = std::exchange(short_of_disk_, false);
      removing = std::exchange(deleted_, false) || removing || short_of_disk;
    }
    if (log_pages_ >= checkpoint_pages_ || short_of_disk) Checkpoint();
    // If the disk fails, what is left is removed when another session is deleted, when the disk is
    // full, or after the journal is opened again.
    if (removing) removing = RemoveSomeDeleted().value_or(false);
  }
}

// Takes the reserve back if there is room again. As long as there is none, tries to make some.
absl::Status SqliteJournal::CheckDisk(SqliteDatabase& database) {
  if (reserve_->held() == DiskReserve::Held::kAll) return absl::OkStatus();
  POLYEST_ASSIGN_OR_RETURN(const int64_t reusable, database.Number("PRAGMA freelist_count"));
  const DiskReserve::Held held = reserve_->TakeBack(reusable * kPageBytes);
  // With half of the reserve the database must not grow.
  const bool grows = held != DiskReserve::Held::kHalf;
  if (std::exchange(grows_, grows) != grows) {
    POLYEST_ASSIGN_OR_RETURN(const int64_t pages, database.Number("PRAGMA page_count"));
    POLYEST_RETURN_IF_ERROR(
        database.Execute(absl::StrCat("PRAGMA max_page_count = ", grows ? max_pages_ : pages)));
  }
  if (held != DiskReserve::Held::kNothing) return absl::OkStatus();
  const std::lock_guard lock(maintenance_mutex_);
  short_of_disk_ = true;
  maintenance_.notify_one();
  return DiskFull();
}

bool SqliteJournal::FreeDisk() {
  const bool made = reserve_->GiveUp();
  if (made) spdlog::warn("the disk is full: no measurements are taken until there is room");
  return made;
}

// Copies the write-ahead log into the file. The first pass copies what is there while another
// thread goes on writing batches, so that they do not wait. The second one holds up the writer,
// copies the rest and makes the log short. It is tried only where the rest is small, or the log has
// become long, and gives up at once where somebody still reads from the log: the writer would have
// to wait for them. The next commit then leads here again.
void SqliteJournal::Checkpoint() {
  sqlite3* const handle = maintainer_->handle();
  int pages = 0, copied = 0;
  const auto copy = [&] {
    return sqlite3_wal_checkpoint_v2(handle, nullptr, SQLITE_CHECKPOINT_PASSIVE, &pages, &copied);
  };
  // The file may have to grow.
  if (IsDiskFull(FromSqlite(copy(), "the log")) && FreeDisk()) copy();
  if (pages - copied < kShortRest || pages > kLongLog) {
    sqlite3_busy_timeout(handle, 0);
    sqlite3_wal_checkpoint_v2(handle, nullptr, SQLITE_CHECKPOINT_TRUNCATE, nullptr, nullptr);
    sqlite3_busy_timeout(handle, kBusyTimeoutMs);
  }
  log_pages_ = 0;
}

// Removes some batches of a deleted session. Returns whether there may be more to remove.
absl::StatusOr<bool> SqliteJournal::RemoveSomeDeleted() {
  // A seal that came back after a power failure would tell of a session that is missing.
  seals_->Sync();
  int64_t session = 0;
  {
    // A damaged file may name a session that is not deleted.
    SqliteQuery query(*maintainer_,
                      "SELECT session FROM deleted WHERE session NOT IN (SELECT number FROM "
                      "session) LIMIT 1");
    POLYEST_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return false;
    session = query.Integer(0);
  }
  const int64_t max_bytes = std::min(kRemovedBytes, reserve_->bytes() / kRemovalShare);
  const auto remove = [=](SqliteDatabase& database) -> absl::Status {
    for (const auto remove_some : {RemoveSomeBatches, RemoveSomeParts}) {
      POLYEST_ASSIGN_OR_RETURN(const bool removed, remove_some(database, session, max_bytes));
      if (removed) return absl::OkStatus();
    }
    POLYEST_RETURN_IF_ERROR(
        RunForSession(database, "DELETE FROM snapshot WHERE session = ?", session));
    POLYEST_RETURN_IF_ERROR(
        RunForSession(database, "DELETE FROM history WHERE session = ?", session));
    return RunForSession(database, "DELETE FROM deleted WHERE session = ?", session);
  };
  POLYEST_RETURN_IF_ERROR(queue_->Run(remove, "", DiskUse::kFreesRoom));
  return true;
}

}  // namespace polyest::internal
