#include "server/journal/sqlite_journal.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <sqlite3.h>

#include <utility>

#include "core/common/status.h"
#include "server/digest/digest.h"
#include "server/journal/journal_check.h"
#include "server/journal/seal_check.h"
#include "server/journal/session_digest.h"
#include "server/journal/sqlite_schema.h"
#include "server/journal/sqlite_writes.h"

namespace polyest::internal {
namespace {

constexpr int64_t kPageBytes = 4'096;

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
  POLYEST_ASSIGN_OR_RETURN(auto seals, SessionSeals::Open(folder->seals_file()));
  const absl::Status restored = RestoreBackupSeals(**writer, *seals);
  if (!restored.ok()) return named(restored);
  auto found = CheckSeals(**writer, *seals);
  if (!found.ok()) return named(found.status());
  auto maintainer = SqliteDatabase::Open(file);
  if (!maintainer.ok()) return named(maintainer.status());
  return std::unique_ptr<SqliteJournal>(new SqliteJournal(std::move(folder), *std::move(writer),
                                                          *std::move(maintainer), std::move(seals),
                                                          *std::move(found), options.on_commit));
}

SqliteJournal::SqliteJournal(std::unique_ptr<DataFolder> folder,
                             std::unique_ptr<SqliteDatabase> writer,
                             std::unique_ptr<SqliteDatabase> maintainer,
                             std::unique_ptr<SessionSeals> seals, std::vector<std::string> damage,
                             OnCommit on_commit)
    : folder_(std::move(folder)),
      damage_(std::move(damage)),
      maintainer_(std::move(maintainer)),
      seals_(std::move(seals)) {
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
  const auto seal = [this, on_commit = std::move(on_commit)](const CommitReport& commit) {
    SealCommit(commit.outcome.ok());
    if (on_commit) on_commit(commit);
  };
  ReadTenants(*writer);
  queue_ = std::make_unique<CommitQueue<SqliteDatabase>>(std::move(writer), seal);
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

absl::StatusOr<std::vector<SessionHead>> SqliteJournal::Heads() const {
  Reader reader(*this);
  POLYEST_ASSIGN_OR_RETURN(SqliteDatabase* const database, reader.database());
  SqliteQuery query(
      *database,
      "SELECT number, tenant, name, hidden, created_s, created_ns, reorder_window_s, problem, "
      "session.digest, coalesce(sequence, 0), coalesce(place_samples, 0), coalesce(place_rows, 0), "
      "coalesce(place_run, 0), coalesce(place_time_s, 0) FROM session LEFT JOIN batch ON "
      "batch.session = number AND sequence = (SELECT max(sequence) FROM batch WHERE session = "
      "number) ORDER BY tenant, name");
  std::vector<SessionHead> heads;
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(const bool more, query.Step());
    if (!more) return heads;
    SessionRow row = ReadSessionRow(query);
    if (row.hidden && !row.damaged) continue;
    SessionHead& head = heads.emplace_back(std::move(row.head));
    head.place.sequence = query.Integer(9);
    head.place.samples = query.Integer(10);
    head.place.rows = query.Integer(11);
    head.place.last_row = {static_cast<int>(query.Integer(12)), query.Real(13)};
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
  const absl::Status deleted =
      queue_->Run([this, session](SqliteDatabase& database) -> absl::Status {
        POLYEST_RETURN_IF_ERROR(
            RunForSession(database, "DELETE FROM session WHERE number = ?", session));
        if (database.changes() == 0) return NoSuchSession();
        unsealed_[session] = std::nullopt;
        return RunForSession(database, "INSERT INTO deleted VALUES (?)", session);
      });
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
  const auto bytes = static_cast<int64_t>(entry.measurements.size());
  queue_->Submit(
      [this, entry = std::move(entry)](SqliteDatabase& database) -> absl::Status {
        POLYEST_RETURN_IF_ERROR(InsertBatch(database, entry));
        auto& seal = unsealed_[entry.session];
        if (!seal) seal = seals_->Of(entry.session);
        if (!seal) seal = Seal::At(entry.session, "", "", entry.place.sequence - 1);
        seal->Add(entry.place.sequence, entry.digest);
        return absl::OkStatus();
      },
      std::move(done), lane, bytes);
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

absl::StatusOr<v1::Problem> SqliteJournal::ReadProblem(int64_t session) const {
  Reader reader(*this);
  POLYEST_ASSIGN_OR_RETURN(SqliteDatabase* const database, reader.database());
  SqliteQuery query(*database,
                    "SELECT number, tenant, name, hidden, created_s, created_ns, reorder_window_s, "
                    "problem, digest FROM session WHERE number = ?");
  query.Bind(session);
  POLYEST_ASSIGN_OR_RETURN(const bool there, query.Step());
  if (!there) return NoSuchSession();
  const SessionRow row = ReadSessionRow(query);
  v1::Problem problem;
  if (!row.damaged && problem.ParseFromString(row.problem)) return problem;
  return absl::DataLossError(
      absl::StrFormat("%s is damaged in the journal: its name, its window or its problem is not "
                      "what was stored",
                      row.head.name));
}

absl::Status SqliteJournal::ReadBatches(
    int64_t session, int64_t after,
    const std::function<absl::Status(const JournalBatch&)>& take) const {
  // The seal is looked up first, so that the statement sees its batches.
  const std::optional<Seal> seal = after == 0 ? seals_->Of(session) : std::nullopt;
  Seal read = Seal::At(session, "", "", seal ? seal->from : 0);
  Reader reader(*this);
  POLYEST_ASSIGN_OR_RETURN(SqliteDatabase* const database, reader.database());
  // One statement looks for the session and for its batches, because the session may be deleted and
  // its batches removed between two. Without batches it gives one row, which has no sequence.
  SqliteQuery query(*database,
                    "SELECT sequence, measurements, batch.digest FROM session LEFT JOIN batch ON "
                    "batch.session = number AND sequence > ?2 WHERE number = ?1 ORDER BY sequence");
  query.Bind(session).Bind(after);
  POLYEST_ASSIGN_OR_RETURN(bool row, query.Step());
  if (!row) return NoSuchSession();
  JournalBatch batch;
  batch.sequence = after;
  while (row && query.Integer(0) > 0) {
    const std::string bytes = query.Bytes(1);
    const bool whole = query.Integer(0) == batch.sequence + 1 && query.Bytes(2) == Digest(bytes) &&
                       batch.measurements.ParseFromString(bytes);
    ++batch.sequence;
    if (seal && batch.sequence > seal->from) read.Add(batch.sequence, query.Bytes(2));
    if (!whole) {
      return absl::DataLossError(absl::StrFormat(
          "batch %d of the session is damaged or missing in the journal", batch.sequence));
    }
    if (seal && batch.sequence == seal->sequence && read.chain != seal->chain) {
      return absl::DataLossError(
          absl::StrFormat("batches %d to %d of the session are not those that were acknowledged",
                          seal->from + 1, seal->sequence));
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

}  // namespace polyest::internal
