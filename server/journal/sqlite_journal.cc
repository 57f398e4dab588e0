#include "server/journal/sqlite_journal.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <sqlite3.h>

#include <algorithm>
#include <utility>

#include "core/common/status.h"
#include "server/digest/digest.h"
#include "server/journal/journal_check.h"
#include "server/journal/seal_check.h"
#include "server/journal/session_digest.h"
#include "server/journal/sqlite_parts.h"
#include "server/journal/sqlite_schema.h"
#include "server/journal/sqlite_writes.h"

namespace polyest::internal {
namespace {

// The largest number of pages that SQLite knows.
constexpr int64_t kUnlimitedPages = 0x3fffffff;
// The most pages of the write-ahead log before they are copied into the file: 4 MB. The disk keeps
// commits waiting while it takes the copies.
constexpr int kMaxCheckpointPages = 1'000;
// Bytes of the reserve for each of these pages, so that the log has room in half of it.
constexpr int64_t kReserveOfPage = 4 * 4'096;

int64_t MaxPages(int64_t max_mb) {
  return max_mb == 0 ? kUnlimitedPages : std::min(max_mb * (1'048'576 / 4'096), kUnlimitedPages);
}

absl::Status SetUpWriter(SqliteDatabase& database, int64_t max_pages) {
  POLYEST_RETURN_IF_ERROR(PrepareSchema(database));
  POLYEST_RETURN_IF_ERROR(database.Execute("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL"));
  POLYEST_RETURN_IF_ERROR(database.Execute(absl::StrCat("PRAGMA max_page_count = ", max_pages)));
  // A full disk may refuse this. The parts that stay are never read.
  DeleteUnfinishedParts(database).IgnoreError();
  return DeleteHidden(database);
}

}  // namespace

absl::StatusOr<std::unique_ptr<SqliteJournal>> SqliteJournal::Open(
    const SqliteJournalOptions& options) {
  POLYEST_ASSIGN_OR_RETURN(auto folder, DataFolder::Take(options.folder));
  const std::string& file = folder->journal_file();
  // Whatever is written below has the room of the reserve.
  auto reserve = std::make_unique<DiskReserve>(folder->reserve_file());
  const auto named = [&](const absl::Status& status) {
    return absl::Status(status.code(), absl::StrFormat("%s: %s", file, status.message()));
  };
  auto writer = SqliteDatabase::Open(file);
  if (!writer.ok()) return named(writer.status());
  const absl::Status prepared = SetUpWriter(**writer, MaxPages(options.max_mb));
  if (!prepared.ok()) return named(prepared);
  POLYEST_ASSIGN_OR_RETURN(auto seals, SessionSeals::Open(folder->seals_file()));
  const absl::Status restored = RestoreBackupSeals(**writer, *seals);
  if (!restored.ok()) return named(restored);
  auto found = CheckSeals(**writer, *seals);
  if (!found.ok()) return named(found.status());
  auto maintainer = SqliteDatabase::Open(file);
  if (!maintainer.ok()) return named(maintainer.status());
  return std::unique_ptr<SqliteJournal>(
      new SqliteJournal(std::move(folder), std::move(reserve), *std::move(writer),
                        *std::move(maintainer), std::move(seals), *std::move(found), options));
}

SqliteJournal::SqliteJournal(std::unique_ptr<DataFolder> folder,
                             std::unique_ptr<DiskReserve> reserve,
                             std::unique_ptr<SqliteDatabase> writer,
                             std::unique_ptr<SqliteDatabase> maintainer,
                             std::unique_ptr<SessionSeals> seals, std::vector<std::string> damage,
                             const SqliteJournalOptions& options)
    : folder_(std::move(folder)),
      reserve_(std::move(reserve)),
      checkpoint_pages_(static_cast<int>(
          std::clamp<int64_t>(reserve_->bytes() / kReserveOfPage, 1, kMaxCheckpointPages))),
      damage_(std::move(damage)),
      max_pages_(MaxPages(options.max_mb)),
      maintainer_(std::move(maintainer)),
      seals_(std::move(seals)) {
  // This hook takes the place of SQLite's own checkpoint, which would delay the commit that it
  // follows.
  sqlite3_wal_hook(
      writer->handle(),
      [](void* self, sqlite3*, const char*, int pages) {
        auto& journal = *static_cast<SqliteJournal*>(self);
        journal.log_pages_ = pages;
        if (pages >= journal.checkpoint_pages_) journal.WakeMaintenance();
        return SQLITE_OK;
      },
      this);
  const auto seal = [this, on_commit = options.on_commit](const CommitReport& commit) {
    SealCommit(commit.outcome.ok());
    if (on_commit) on_commit(commit);
  };
  ReadTenants(*writer);
  CheckDisk(*writer).IgnoreError();
  queue_ = std::make_unique<CommitQueue<SqliteDatabase>>(
      std::move(writer), seal,
      CommitQueue<SqliteDatabase>::FullDisk{
          .check = [this](SqliteDatabase& database) { return CheckDisk(database); },
          .make = [this] { return FreeDisk(); }});
  maintenance_thread_ = std::jthread([this](std::stop_token stop) { Maintain(stop); });
}

SqliteJournal::~SqliteJournal() {
  maintenance_thread_.request_stop();
  maintenance_thread_.join();
  queue_ = nullptr;
}

void SqliteJournal::ReadTenants(SqliteDatabase& database) {
  SqliteQuery query(database, "SELECT number, tenant FROM session");
  while (query.Step().value_or(false)) tenants_[query.Integer(0)] = query.Bytes(1);
}

absl::Status SqliteJournal::CheckWritable() {
  // This writes as much as a batch may well have, because a full disk still takes a little.
  return queue_->Run([](SqliteDatabase& database) {
    return database.Execute(
        "CREATE TABLE room (bytes BLOB); INSERT INTO room VALUES (zeroblob(65536)); "
        "DROP TABLE room");
  });
}

// Seals what a commit has kept, on the writer's thread and before anybody hears of it.
void SqliteJournal::SealCommit(bool kept) {
  if (kept) {
    for (const auto& [session, seal] : unsealed_) {
      if (seal) {
        seals_->Put(*seal);
      } else {
        seals_->Remove(session);
      }
    }
  }
  unsealed_.clear();
}

absl::StatusOr<int64_t> SqliteJournal::Create(const SessionHead& head, const v1::Problem& problem,
                                              bool hidden) {
  int64_t number = 0;
  const std::string bytes = DeterministicBytes(problem);
  const auto insert = [&](SqliteDatabase& database) -> absl::Status {
    SqliteQuery query(database,
                      "INSERT INTO session (tenant, name, hidden, created_s, created_ns, problem, "
                      "reorder_window_s) VALUES (?, ?, ?, ?, ?, ?, ?)");
    query.BindText(head.tenant)
        .BindText(head.name)
        .Bind(static_cast<int64_t>(hidden))
        .Bind(head.create_time.seconds())
        .Bind(static_cast<int64_t>(head.create_time.nanos()))
        .BindBlob(bytes)
        .Bind(head.reorder_window_s);
    POLYEST_RETURN_IF_ERROR(query.Run());
    number = database.last_insert_rowid();
    SessionHead created = head;
    created.number = number;
    unsealed_[number] = Seal::At(number, SealLabel(head.tenant, head.name),
                                 SessionDigest(created, /*hidden=*/false, bytes), 0);
    return WriteSessionDigest(database, number);
  };
  POLYEST_RETURN_IF_ERROR(queue_->Run(insert));
  const std::lock_guard lock(tenants_mutex_);
  tenants_[number] = head.tenant;
  return number;
}

std::string SqliteJournal::LaneOf(int64_t session) const {
  const std::lock_guard lock(tenants_mutex_);
  const auto tenant = tenants_.find(session);
  // No tenant has the lane without a name, in which sessions are created and deleted.
  return tenant == tenants_.end() ? "" : "tenant " + tenant->second;
}

absl::Status SqliteJournal::Show(int64_t session) {
  return queue_->Run([=](SqliteDatabase& database) -> absl::Status {
    POLYEST_RETURN_IF_ERROR(
        RunForSession(database, "UPDATE session SET hidden = 0 WHERE number = ?", session));
    if (database.changes() == 0) return NoSuchSession();
    return WriteSessionDigest(database, session);
  });
}

absl::Status SqliteJournal::Delete(int64_t session) {
  const auto remove = [this, session](SqliteDatabase& database) -> absl::Status {
    POLYEST_RETURN_IF_ERROR(
        RunForSession(database, "DELETE FROM session WHERE number = ?", session));
    if (database.changes() == 0) return NoSuchSession();
    unsealed_[session] = std::nullopt;
    return RunForSession(database, "INSERT INTO deleted VALUES (?)", session);
  };
  const absl::Status deleted = queue_->Run(remove, "", DiskUse::kFreesRoom);
  if (deleted.ok()) {
    {
      const std::lock_guard lock(tenants_mutex_);
      tenants_.erase(session);
    }
    const std::lock_guard lock(maintenance_mutex_);
    deleted_ = true;
    maintenance_.notify_one();
  }
  return deleted;
}

void SqliteJournal::Append(JournalEntry entry, Done done) {
  const std::string lane = LaneOf(entry.session);
  const auto insert = [this](SqliteDatabase& database, const JournalEntry& batch,
                             const BatchPart& last) -> absl::Status {
    POLYEST_RETURN_IF_ERROR(InsertBatch(database, batch, last));
    auto& seal = unsealed_[batch.session];
    if (!seal) seal = seals_->Of(batch.session);
    if (!seal) seal = Seal::At(batch.session, "", "", batch.place.sequence - 1);
    seal->Add(batch.place.sequence, batch.digest);
    return absl::OkStatus();
  };
  SubmitInParts(*queue_, std::move(entry), lane, InsertPart, insert, RemoveRefused,
                std::move(done));
}

void SqliteJournal::SaveSnapshot(int64_t session, JournalSnapshot snapshot) {
  const auto bytes = static_cast<int64_t>(snapshot.state.size());
  queue_->Submit(
      [session, snapshot = std::move(snapshot)](SqliteDatabase& database) {
        return ReplaceSnapshot(database, session, snapshot);
      },
      [](const absl::Status&) {}, LaneOf(session), bytes);
}

void SqliteJournal::SaveHistoryPoint(int64_t session, JournalHistoryPoint point, int64_t stride) {
  queue_->SubmitLazily(
      [session, point = std::move(point), stride](SqliteDatabase& database) {
        return InsertHistoryPoint(database, session, point, stride);
      },
      LaneOf(session));
}

}  // namespace polyest::internal
