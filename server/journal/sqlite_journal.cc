#include "server/journal/sqlite_journal.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <sqlite3.h>

#include <utility>

#include "core/common/status.h"
#include "server/digest/digest.h"
#include "server/journal/sqlite_schema.h"

namespace polyest::internal {
namespace {

// Number of pages in the write-ahead log from which on they are copied into the file.
constexpr int kCheckpointPages = 4'000;
constexpr int64_t kPageBytes = 4'096;
// Largest number of batches of a deleted session that one commit removes.
constexpr int64_t kRemovedBatches = 256;

absl::Status NotThere() { return absl::NotFoundError("the journal has no such session"); }

absl::Status InsertBatch(SqliteDatabase& database, const JournalEntry& entry) {
  SqliteQuery query(database,
                    "INSERT INTO batch SELECT ?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8 WHERE ?2 = 1 + "
                    "(SELECT coalesce(max(sequence), 0) FROM batch WHERE session = ?1) AND "
                    "EXISTS (SELECT 1 FROM session WHERE number = ?1)");
  query.Bind(entry.session)
      .Bind(entry.place.sequence)
      .BindBlob(entry.measurements)
      .BindBlob(entry.digest)
      .Bind(entry.place.samples)
      .Bind(entry.place.rows)
      .Bind(static_cast<int64_t>(entry.place.last_row.run))
      .Bind(entry.place.last_row.time_s);
  POLYEST_RETURN_IF_ERROR(query.Run());
  if (database.changes() > 0) return absl::OkStatus();
  SqliteQuery session(database, "SELECT 1 FROM session WHERE number = ?");
  session.Bind(entry.session);
  POLYEST_ASSIGN_OR_RETURN(const bool there, session.Step());
  if (!there) return NotThere();
  return absl::FailedPreconditionError(
      absl::StrFormat("batch %d does not follow what the journal has", entry.place.sequence));
}

absl::Status ReplaceSnapshot(SqliteDatabase& database, int64_t session,
                             const JournalSnapshot& snapshot) {
  SqliteQuery query(database,
                    "INSERT OR REPLACE INTO snapshot SELECT ?1, ?2, ?3, ?4 WHERE EXISTS "
                    "(SELECT 1 FROM batch WHERE session = ?1 AND sequence = ?2)");
  query.Bind(session).Bind(snapshot.sequence).Bind(snapshot.rows).BindBlob(snapshot.state);
  return query.Run();
}

absl::Status InsertHistoryPoint(SqliteDatabase& database, int64_t session,
                                const JournalHistoryPoint& point, int64_t stride) {
  SqliteQuery insert(database,
                     "INSERT OR REPLACE INTO history SELECT ?1, ?2, ?3, ?4 WHERE EXISTS "
                     "(SELECT 1 FROM batch WHERE session = ?1 AND sequence = ?3)");
  insert.Bind(session).Bind(point.ordinal).Bind(point.sequence).BindBlob(point.point);
  POLYEST_RETURN_IF_ERROR(insert.Run());
  if (stride == 1) return absl::OkStatus();
  SqliteQuery thin(database, "DELETE FROM history WHERE session = ? AND ordinal % ? <> 0");
  thin.Bind(session).Bind(stride);
  return thin.Run();
}

absl::Status RunFor(SqliteDatabase& database, const char* sql, int64_t session) {
  SqliteQuery query(database, sql);
  query.Bind(session);
  return query.Run();
}

// Deletes the sessions that were never shown: those of imports that did not come to their end.
absl::Status DeleteHidden(SqliteDatabase& database) {
  return database.Execute(
      "BEGIN IMMEDIATE; INSERT INTO deleted SELECT number FROM session WHERE hidden = 1;"
      "DELETE FROM session WHERE hidden = 1; COMMIT");
}

absl::Status SetUpWriter(SqliteDatabase& database, int64_t max_mb) {
  POLYEST_RETURN_IF_ERROR(PrepareSchema(database));
  POLYEST_RETURN_IF_ERROR(database.Execute("PRAGMA journal_mode = WAL; PRAGMA synchronous = FULL"));
  if (max_mb > 0) {
    const int64_t pages = max_mb * 1024 * 1024 / kPageBytes;
    POLYEST_RETURN_IF_ERROR(database.Execute(absl::StrCat("PRAGMA max_page_count = ", pages)));
  }
  return DeleteHidden(database);
}

}  // namespace

class SqliteJournal::Reader {
 public:
  explicit Reader(const SqliteJournal& journal) : journal_(journal) {
    const std::lock_guard lock(journal.readers_mutex_);
    if (journal.readers_.empty()) return;
    database_ = std::move(journal.readers_.back());
    journal.readers_.pop_back();
  }
  ~Reader() {
    if (database_ == nullptr) return;
    const std::lock_guard lock(journal_.readers_mutex_);
    journal_.readers_.push_back(std::move(database_));
  }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;

  absl::StatusOr<SqliteDatabase*> database() {
    if (database_ == nullptr) {
      POLYEST_ASSIGN_OR_RETURN(database_, SqliteDatabase::Open(journal_.folder_->journal_file()));
    }
    return database_.get();
  }

 private:
  const SqliteJournal& journal_;
  std::unique_ptr<SqliteDatabase> database_;
};

absl::StatusOr<std::unique_ptr<SqliteJournal>> SqliteJournal::Open(
    const SqliteJournalOptions& options) {
  POLYEST_ASSIGN_OR_RETURN(auto folder, DataFolder::Take(options.folder));
  const std::string& file = folder->journal_file();
  const auto named = [&](const absl::Status& status) {
    return absl::Status(status.code(), absl::StrFormat("%s: %s", file, status.message()));
  };
  auto writer = SqliteDatabase::Open(file);
  if (!writer.ok()) return named(writer.status());
  const absl::Status prepared = SetUpWriter(**writer, options.max_mb);
  if (!prepared.ok()) return named(prepared);
  auto maintainer = SqliteDatabase::Open(file);
  if (!maintainer.ok()) return named(maintainer.status());
  return std::unique_ptr<SqliteJournal>(new SqliteJournal(
      std::move(folder), *std::move(writer), *std::move(maintainer), options.on_commit));
}

SqliteJournal::SqliteJournal(std::unique_ptr<DataFolder> folder,
                             std::unique_ptr<SqliteDatabase> writer,
                             std::unique_ptr<SqliteDatabase> maintainer,
                             CommitQueue::OnCommit on_commit)
    : folder_(std::move(folder)), maintainer_(std::move(maintainer)) {
  // This hook takes the place of SQLite's own checkpoint, which would delay the commit that it
  // follows.
  sqlite3_wal_hook(
      writer->handle(),
      [](void* self, sqlite3*, const char*, int pages) {
        auto& journal = *static_cast<SqliteJournal*>(self);
        journal.log_pages_ = pages;
        if (pages >= kCheckpointPages) journal.WakeMaintenance();
        return SQLITE_OK;
      },
      this);
  queue_ = std::make_unique<CommitQueue>(std::move(writer), std::move(on_commit));
  maintenance_thread_ = std::jthread([this](std::stop_token stop) { Maintain(stop); });
}

SqliteJournal::~SqliteJournal() {
  maintenance_thread_.request_stop();
  maintenance_thread_.join();
  queue_ = nullptr;
}

absl::Status SqliteJournal::CheckWritable() {
  // This writes as much as a batch may well have, because a full disk still takes a little.
  return queue_->Run([](SqliteDatabase& database) {
    return database.Execute(
        "CREATE TABLE room (bytes BLOB); INSERT INTO room VALUES (zeroblob(65536)); "
        "DROP TABLE room");
  });
}

absl::StatusOr<std::vector<SessionHead>> SqliteJournal::Heads() const {
  Reader reader(*this);
  POLYEST_ASSIGN_OR_RETURN(SqliteDatabase* const database, reader.database());
  SqliteQuery query(
      *database,
      "SELECT number, tenant, name, created_s, created_ns, coalesce(sequence, 0), "
      "coalesce(place_samples, 0), coalesce(place_rows, 0), coalesce(place_run, 0), "
      "coalesce(place_time_s, 0), reorder_window_s FROM session LEFT JOIN batch ON batch.session "
      "= number AND sequence = (SELECT max(sequence) FROM batch WHERE session = number) "
      "WHERE hidden = 0 ORDER BY tenant, name");
  std::vector<SessionHead> heads;
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return heads;
    SessionHead& head = heads.emplace_back();
    head.number = query.Integer(0);
    head.tenant = query.Bytes(1);
    head.name = query.Bytes(2);
    head.create_time.set_seconds(query.Integer(3));
    head.create_time.set_nanos(static_cast<int32_t>(query.Integer(4)));
    head.place.sequence = query.Integer(5);
    head.place.samples = query.Integer(6);
    head.place.rows = query.Integer(7);
    head.place.last_row = {static_cast<int>(query.Integer(8)), query.Real(9)};
    head.reorder_window_s = query.Real(10);
  }
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
    return absl::OkStatus();
  };
  POLYEST_RETURN_IF_ERROR(queue_->Run(insert));
  return number;
}

absl::Status SqliteJournal::Show(int64_t session) {
  return queue_->Run([=](SqliteDatabase& database) -> absl::Status {
    POLYEST_RETURN_IF_ERROR(
        RunFor(database, "UPDATE session SET hidden = 0 WHERE number = ?", session));
    return database.changes() > 0 ? absl::OkStatus() : NotThere();
  });
}

absl::Status SqliteJournal::Delete(int64_t session) {
  const absl::Status deleted = queue_->Run([=](SqliteDatabase& database) -> absl::Status {
    POLYEST_RETURN_IF_ERROR(RunFor(database, "DELETE FROM session WHERE number = ?", session));
    if (database.changes() == 0) return NotThere();
    return RunFor(database, "INSERT INTO deleted VALUES (?)", session);
  });
  if (deleted.ok()) {
    const std::lock_guard lock(maintenance_mutex_);
    deleted_ = true;
    maintenance_.notify_one();
  }
  return deleted;
}

void SqliteJournal::Append(JournalEntry entry, Done done) {
  queue_->Submit(
      [entry = std::move(entry)](SqliteDatabase& database) { return InsertBatch(database, entry); },
      std::move(done));
}

void SqliteJournal::SaveSnapshot(int64_t session, JournalSnapshot snapshot) {
  queue_->Submit(
      [session, snapshot = std::move(snapshot)](SqliteDatabase& database) {
        return ReplaceSnapshot(database, session, snapshot);
      },
      [](const absl::Status&) {});
}

void SqliteJournal::SaveHistoryPoint(int64_t session, JournalHistoryPoint point, int64_t stride) {
  queue_->SubmitLazily([session, point = std::move(point), stride](SqliteDatabase& database) {
    return InsertHistoryPoint(database, session, point, stride);
  });
}

absl::StatusOr<v1::Problem> SqliteJournal::ReadProblem(int64_t session) const {
  Reader reader(*this);
  POLYEST_ASSIGN_OR_RETURN(SqliteDatabase* const database, reader.database());
  SqliteQuery query(*database, "SELECT problem FROM session WHERE number = ?");
  query.Bind(session);
  POLYEST_ASSIGN_OR_RETURN(const bool row, query.Step());
  if (!row) return NotThere();
  v1::Problem problem;
  if (problem.ParseFromString(query.Bytes(0))) return problem;
  return absl::DataLossError("the session's problem cannot be read from the journal");
}

absl::Status SqliteJournal::ReadBatches(
    int64_t session, int64_t after,
    const std::function<absl::Status(const JournalBatch&)>& take) const {
  Reader reader(*this);
  POLYEST_ASSIGN_OR_RETURN(SqliteDatabase* const database, reader.database());
  // One statement looks for the session and for its batches, because the session may be deleted and
  // its batches removed between two. Without batches it gives one row, which has no sequence.
  SqliteQuery query(*database,
                    "SELECT sequence, measurements, digest FROM session LEFT JOIN batch ON "
                    "batch.session = number AND sequence > ?2 WHERE number = ?1 ORDER BY sequence");
  query.Bind(session).Bind(after);
  POLYEST_ASSIGN_OR_RETURN(bool row, query.Step());
  if (!row) return NotThere();
  JournalBatch batch;
  batch.sequence = after;
  while (row && query.Integer(0) > 0) {
    const std::string bytes = query.Bytes(1);
    const bool whole = query.Integer(0) == batch.sequence + 1 && query.Bytes(2) == Digest(bytes) &&
                       batch.measurements.ParseFromString(bytes);
    ++batch.sequence;
    if (!whole) {
      return absl::DataLossError(absl::StrFormat(
          "batch %d of the session is damaged or missing in the journal", batch.sequence));
    }
    POLYEST_RETURN_IF_ERROR(take(batch));
    POLYEST_ASSIGN_OR_RETURN(row, query.Step());
  }
  return absl::OkStatus();
}

absl::StatusOr<std::string> SqliteJournal::ReadDigest(int64_t session, int64_t sequence) const {
  Reader reader(*this);
  POLYEST_ASSIGN_OR_RETURN(SqliteDatabase* const database, reader.database());
  SqliteQuery query(*database, "SELECT digest FROM batch WHERE session = ? AND sequence = ?");
  query.Bind(session).Bind(sequence);
  POLYEST_ASSIGN_OR_RETURN(const bool row, query.Step());
  if (!row) return absl::NotFoundError("the journal has no such batch");
  return query.Bytes(0);
}

absl::StatusOr<std::optional<JournalSnapshot>> SqliteJournal::ReadSnapshot(int64_t session) const {
  Reader reader(*this);
  POLYEST_ASSIGN_OR_RETURN(SqliteDatabase* const database, reader.database());
  SqliteQuery query(*database, "SELECT sequence, rows, state FROM snapshot WHERE session = ?");
  query.Bind(session);
  POLYEST_ASSIGN_OR_RETURN(const bool row, query.Step());
  if (!row) return std::nullopt;
  return JournalSnapshot{query.Integer(0), query.Integer(1), query.Bytes(2)};
}

absl::StatusOr<std::vector<JournalHistoryPoint>> SqliteJournal::ReadHistory(int64_t session) const {
  queue_->Flush();
  Reader reader(*this);
  POLYEST_ASSIGN_OR_RETURN(SqliteDatabase* const database, reader.database());
  SqliteQuery query(
      *database, "SELECT ordinal, sequence, point FROM history WHERE session = ? ORDER BY ordinal");
  query.Bind(session);
  std::vector<JournalHistoryPoint> history;
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return history;
    history.push_back({query.Integer(0), query.Integer(1), query.Bytes(2)});
  }
}

void SqliteJournal::WakeMaintenance() {
  const std::lock_guard lock(maintenance_mutex_);
  maintenance_.notify_one();
}

void SqliteJournal::Maintain(std::stop_token stop) {
  bool removing = true;
  while (!stop.stop_requested()) {
    {
      std::unique_lock lock(maintenance_mutex_);
      if (!removing) {
        maintenance_.wait(lock, stop,
                          [this] { return log_pages_ >= kCheckpointPages || deleted_; });
      }
      removing = std::exchange(deleted_, false) || removing;
    }
    if (log_pages_ >= kCheckpointPages) Checkpoint();
    // If the disk fails, what is left is removed after the journal is opened again.
    if (removing) removing = RemoveSomeDeleted().value_or(false);
  }
}

// Copies the write-ahead log into the file. The first pass copies most of it while another thread
// goes on writing batches, so that they do not wait. The second one holds up the writer and copies
// the rest, because the log could otherwise grow without end.
void SqliteJournal::Checkpoint() {
  for (const int mode : {SQLITE_CHECKPOINT_PASSIVE, SQLITE_CHECKPOINT_TRUNCATE}) {
    sqlite3_wal_checkpoint_v2(maintainer_->handle(), nullptr, mode, nullptr, nullptr);
  }
  log_pages_ = 0;
}

// Removes some batches of a deleted session. Returns whether there may be more to remove.
absl::StatusOr<bool> SqliteJournal::RemoveSomeDeleted() {
  int64_t session = 0;
  {
    SqliteQuery query(*maintainer_, "SELECT session FROM deleted LIMIT 1");
    POLYEST_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return false;
    session = query.Integer(0);
  }
  const auto remove = [=](SqliteDatabase& database) -> absl::Status {
    SqliteQuery query(database,
                      "DELETE FROM batch WHERE rowid IN (SELECT rowid FROM batch WHERE session = ? "
                      "LIMIT ?)");
    query.Bind(session).Bind(kRemovedBatches);
    POLYEST_RETURN_IF_ERROR(query.Run());
    if (database.changes() > 0) return absl::OkStatus();
    POLYEST_RETURN_IF_ERROR(RunFor(database, "DELETE FROM snapshot WHERE session = ?", session));
    POLYEST_RETURN_IF_ERROR(RunFor(database, "DELETE FROM history WHERE session = ?", session));
    return RunFor(database, "DELETE FROM deleted WHERE session = ?", session);
  };
  POLYEST_RETURN_IF_ERROR(queue_->Run(remove));
  return true;
}

}  // namespace polyest::internal
