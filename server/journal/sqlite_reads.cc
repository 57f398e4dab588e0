// Reads from the journal (sqlite_journal.h), each time with a connection of its own.

#include <absl/strings/str_format.h>

#include <algorithm>
#include <utility>

#include "core/common/status.h"
#include "server/digest/digest.h"
#include "server/journal/session_row.h"
#include "server/journal/sqlite_journal.h"
#include "server/journal/sqlite_parts.h"

namespace polyest::internal {
namespace {

// Bytes of batches that are read at once: a few for those who need only some batches, more and more
// for those who go on.
constexpr size_t kFirstPageBytes = size_t{64} << 10;
constexpr size_t kMaxPageBytes = size_t{1} << 20;

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
      POLYEST_ASSIGN_OR_RETURN(auto opened, SqliteDatabase::Open(journal_.folder_->journal_file()));
      // There may be as many readers as threads, and what they read they seldom need again.
      POLYEST_RETURN_IF_ERROR(opened->Execute("PRAGMA cache_size = -256"));
      database_ = std::move(opened);
    }
    return database_.get();
  }

 private:
  const SqliteJournal& journal_;
  std::unique_ptr<SqliteDatabase> database_;
};

absl::StatusOr<std::vector<SessionHead>> SqliteJournal::Heads() const {
  Reader reader(*this);
  POLYEST_ASSIGN_OR_RETURN(SqliteDatabase* const database, reader.database());
  SqliteQuery query(
      *database,
      "SELECT " POLYEST_ROW_COLUMNS ", " POLYEST_PLACE_COLUMNS
      ", length(problem) + coalesce(place_bytes, 0), coalesce((SELECT length(state) FROM snapshot "
      "WHERE session = number), 0) FROM session LEFT JOIN batch ON batch.session = number AND "
      "sequence = (SELECT max(sequence) FROM batch WHERE session = number) ORDER BY tenant, name");
  std::vector<SessionHead> heads;
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(const bool more, query.Step());
    if (!more) return heads;
    SessionRow row = ReadSessionRow(query);
    if (row.hidden && !row.damaged) continue;
    SessionHead& head = heads.emplace_back(std::move(row.head));
    head.place = ReadSessionPlace(query, kRowColumns);
    head.bytes = query.Integer(kRowColumns + kPlaceColumns);
    head.snapshot_bytes = query.Integer(kRowColumns + kPlaceColumns + 1);
  }
}

absl::StatusOr<v1::Problem> SqliteJournal::ReadProblem(int64_t session) const {
  Reader reader(*this);
  POLYEST_ASSIGN_OR_RETURN(SqliteDatabase* const database, reader.database());
  POLYEST_ASSIGN_OR_RETURN(const auto row, FindSessionRow(*database, session));
  if (!row) return NoSuchSession();
  return ProblemIn(*row);
}

// Returns the number of the last batch of a session, 0 if it has none.
absl::StatusOr<int64_t> SqliteJournal::LastBatch(int64_t session) const {
  Reader reader(*this);
  POLYEST_ASSIGN_OR_RETURN(SqliteDatabase* const database, reader.database());
  SqliteQuery query(*database,
                    "SELECT (SELECT coalesce(max(sequence), 0) FROM batch WHERE session = number) "
                    "FROM session WHERE number = ?");
  query.Bind(session);
  POLYEST_ASSIGN_OR_RETURN(const bool there, query.Step());
  if (!there) return NoSuchSession();
  return query.Integer(0);
}

// Returns batches of a session after batch `after`, in order, until they have so many bytes. Looks
// for the session and for its batches in one statement, because the session may be deleted and its
// batches removed between two.
absl::StatusOr<std::vector<SqliteJournal::KeptBatch>> SqliteJournal::ReadPage(int64_t session,
                                                                              int64_t after,
                                                                              size_t bytes) const {
  Reader reader(*this);
  POLYEST_ASSIGN_OR_RETURN(SqliteDatabase* const database, reader.database());
  // Without batches there is one row, which has no sequence.
  SqliteQuery query(
      *database,
      "SELECT sequence, measurements, batch.digest, parts FROM session LEFT JOIN batch ON "
      "batch.session = number AND sequence > ?2 WHERE number = ?1 ORDER BY sequence");
  query.Bind(session).Bind(after);
  POLYEST_ASSIGN_OR_RETURN(bool row, query.Step());
  if (!row) return NoSuchSession();
  std::vector<KeptBatch> page;
  for (size_t read = 0; row && query.Integer(0) > 0 && read < bytes;) {
    POLYEST_ASSIGN_OR_RETURN(
        std::string measurements,
        JoinParts(*database, session, query.Integer(0), query.Integer(3), query.Bytes(1)));
    page.push_back({query.Integer(0), std::move(measurements), query.Bytes(2)});
    read += page.back().measurements.size();
    POLYEST_ASSIGN_OR_RETURN(row, query.Step());
  }
  return page;
}

// Reads page by page, because the write-ahead log cannot become short while a statement reads from
// it, and `take` may take its time.
absl::Status SqliteJournal::ReadBatches(
    int64_t session, int64_t after,
    const std::function<absl::Status(const JournalBatch&)>& take) const {
  // The seal is looked up first, so that its batches are among those that are read.
  const std::optional<Seal> seal = after == 0 ? seals_->Of(session) : std::nullopt;
  Seal read = Seal::At(session, "", "", seal ? seal->from : 0);
  POLYEST_ASSIGN_OR_RETURN(const int64_t last, LastBatch(session));
  JournalBatch batch;
  batch.sequence = after;
  for (size_t bytes = kFirstPageBytes; batch.sequence < last;
       bytes = std::min(2 * bytes, kMaxPageBytes)) {
    POLYEST_ASSIGN_OR_RETURN(auto page, ReadPage(session, batch.sequence, bytes));
    // A page without batches ends before the last one, which is missing.
    if (page.empty()) page.emplace_back();
    for (const KeptBatch& kept : page) {
      if (batch.sequence == last) break;
      ++batch.sequence;
      if (kept.sequence != batch.sequence || kept.digest != Digest(kept.measurements) ||
          !batch.measurements.ParseFromString(kept.measurements)) {
        return absl::DataLossError(absl::StrFormat(
            "batch %d of the session is damaged or missing in the journal", batch.sequence));
      }
      if (seal && batch.sequence > seal->from) read.Add(batch.sequence, kept.digest);
      if (seal && batch.sequence == seal->sequence && read.chain != seal->chain) {
        return absl::DataLossError(
            absl::StrFormat("batches %d to %d of the session are not those that were acknowledged",
                            seal->from + 1, seal->sequence));
      }
      POLYEST_RETURN_IF_ERROR(take(batch));
    }
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
