#include "server/journal/journal_check.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <sqlite3.h>
#include <unistd.h>

#include <map>
#include <utility>

#include "core/common/status.h"
#include "server/digest/digest.h"
#include "server/journal/history_check.h"
#include "server/journal/seal_check.h"
#include "server/journal/session_row.h"
#include "server/journal/sqlite_parts.h"
#include "server/journal/sqlite_schema.h"

namespace polyest::internal {
namespace {

// Instructions of SQLite between two looks at the stop: some milliseconds.
constexpr int kInstructionsBetweenLooks = 100'000;
// Faults of the structure that are told; further ones say nothing new.
constexpr int kToldFaults = 10;

// Ends the statements of a connection early when it is asked to stop.
class StoppableStatements {
 public:
  StoppableStatements(SqliteDatabase& database, const Stop& stop)
      : handle_(database.handle()), stop_(stop) {
    sqlite3_progress_handler(
        handle_, kInstructionsBetweenLooks,
        [](void* given) { return static_cast<const Stop*>(given)->Check().ok() ? 0 : 1; },
        const_cast<Stop*>(&stop_));
  }
  ~StoppableStatements() { sqlite3_progress_handler(handle_, 0, nullptr, nullptr); }
  StoppableStatements(const StoppableStatements&) = delete;
  StoppableStatements& operator=(const StoppableStatements&) = delete;

 private:
  sqlite3* const handle_;
  const Stop stop_;
};

// Adds what SQLite finds wrong with the structure of the file.
absl::Status CheckStructure(SqliteDatabase& database, std::vector<std::string>& damage) {
  SqliteQuery query(database, "PRAGMA quick_check(10)");
  static_assert(kToldFaults == 10);
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(const bool row, query.Step());
    if (!row) return absl::OkStatus();
    const std::string found = query.Bytes(0);
    if (found != "ok") damage.push_back(absl::StrCat("the structure of the file: ", found));
  }
}

// Compares the batches of a session with their digests and with the seal.
absl::Status CheckBatches(SqliteDatabase& database, const SessionRow& row, const Seal* seal,
                          JournalContents& contents) {
  const std::string label = SealLabel(row.head.tenant, row.head.name);
  Seal read = Seal::At(row.head.number, "", "", seal == nullptr ? 0 : seal->from);
  SqliteQuery query(
      database,
      "SELECT sequence, measurements, digest, parts FROM batch WHERE session = ? ORDER "
      "BY sequence");
  query.Bind(row.head.number);
  int64_t last = 0;
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(const bool more, query.Step());
    if (!more) break;
    ++contents.batches;
    POLYEST_ASSIGN_OR_RETURN(
        const std::string measurements,
        JoinParts(database, row.head.number, query.Integer(0), query.Integer(3), query.Bytes(1)));
    if (query.Integer(0) != last + 1 || query.Bytes(2) != Digest(measurements)) {
      contents.damage.push_back(
          absl::StrFormat("%s: batch %d is damaged or missing", label, last + 1));
      return absl::OkStatus();
    }
    ++last;
    if (seal == nullptr || last <= seal->from) continue;
    read.Add(last, query.Bytes(2));
    if (last == seal->sequence && read.chain != seal->chain) {
      contents.damage.push_back(
          absl::StrFormat("%s: batches %d to %d are not those that were acknowledged", label,
                          seal->from + 1, last));
    }
  }
  if (seal != nullptr && seal->sequence > last) {
    contents.damage.push_back(absl::StrFormat(
        "%s: batches %d to %d were acknowledged and are missing", label, last + 1, seal->sequence));
  }
  return absl::OkStatus();
}

absl::Status CheckSessions(SqliteDatabase& database, JournalContents& contents) {
  POLYEST_ASSIGN_OR_RETURN(const std::vector<Seal> all, ReadBackupSeals(database));
  std::map<int64_t, Seal> seals;
  for (const Seal& seal : all) seals[seal.session] = seal;
  SqliteQuery query(database, "SELECT " POLYEST_ROW_COLUMNS " FROM session ORDER BY number");
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(const bool more, query.Step());
    if (!more) break;
    const SessionRow row = ReadSessionRow(query);
    const auto seal = seals.extract(row.head.number);
    if (row.hidden && !row.damaged) continue;
    ++contents.sessions;
    if (row.damaged) {
      contents.damage.push_back(absl::StrCat(SealLabel(row.head.tenant, row.head.name),
                                             ": its name, its window or its problem is damaged"));
    }
    POLYEST_RETURN_IF_ERROR(
        CheckBatches(database, row, seal.empty() ? nullptr : &seal.mapped(), contents));
  }
  for (const auto& [session, seal] : seals) {
    contents.damage.push_back(absl::StrFormat(
        "%s: it was acknowledged with %d batches and is missing", seal.label, seal.sequence));
  }
  return absl::OkStatus();
}

absl::StatusOr<bool> HasSeals(SqliteDatabase& database) {
  POLYEST_ASSIGN_OR_RETURN(
      const int64_t tables,
      database.Number("SELECT count(*) FROM sqlite_schema WHERE name = 'backup_seal'"));
  return tables > 0;
}

}  // namespace

absl::Status WriteBackupSeals(SqliteDatabase& database, const std::vector<Seal>& seals) {
  POLYEST_RETURN_IF_ERROR(database.Execute(
      "BEGIN; CREATE TABLE backup_seal (session INTEGER PRIMARY KEY, label TEXT, head BLOB, start "
      "INTEGER, sequence INTEGER, chain BLOB)"));
  for (const Seal& seal : seals) {
    SqliteQuery query(database, "INSERT INTO backup_seal VALUES (?, ?, ?, ?, ?, ?)");
    query.Bind(seal.session)
        .BindText(seal.label)
        .BindBlob(seal.head)
        .Bind(seal.from)
        .Bind(seal.sequence)
        .BindBlob(seal.chain);
    POLYEST_RETURN_IF_ERROR(query.Run());
  }
  POLYEST_RETURN_IF_ERROR(database.Execute("COMMIT"));
  return WriteHistoryDigests(database);
}

absl::StatusOr<std::vector<Seal>> ReadBackupSeals(SqliteDatabase& database) {
  std::vector<Seal> seals;
  POLYEST_ASSIGN_OR_RETURN(const bool there, HasSeals(database));
  if (!there) return seals;
  SqliteQuery query(database,
                    "SELECT session, label, head, start, sequence, chain FROM backup_seal");
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(const bool more, query.Step());
    if (!more) return seals;
    seals.push_back({.session = query.Integer(0),
                     .label = query.Bytes(1),
                     .head = query.Bytes(2),
                     .from = query.Integer(3),
                     .sequence = query.Integer(4),
                     .chain = query.Bytes(5)});
  }
}

absl::Status RestoreBackupSeals(SqliteDatabase& database, SessionSeals& seals) {
  POLYEST_ASSIGN_OR_RETURN(const bool there, HasSeals(database));
  if (!there) return absl::OkStatus();
  if (seals.made()) {
    POLYEST_ASSIGN_OR_RETURN(const std::vector<Seal> kept, ReadBackupSeals(database));
    for (const Seal& seal : kept) seals.Put(seal);
    seals.Sync();
  }
  POLYEST_RETURN_IF_ERROR(DropHistoryDigests(database));
  return database.Execute("DROP TABLE backup_seal");
}

absl::StatusOr<JournalContents> CheckJournal(SqliteDatabase& database, const Stop& stop) {
  const StoppableStatements stoppable(database, stop);
  POLYEST_RETURN_IF_ERROR(CheckJournalVersion(database));
  JournalContents contents;
  absl::Status checked = CheckStructure(database, contents.damage);
  if (checked.ok()) checked = CheckSessions(database, contents);
  if (checked.ok()) checked = CheckHistories(database, contents.damage);
  POLYEST_RETURN_IF_ERROR(stop.Check());
  // A database that cannot be read to its end is damaged, which is what was asked.
  if (absl::IsDataLoss(checked)) {
    contents.damage.push_back(std::string(checked.message()));
  } else if (!checked.ok()) {
    return checked;
  }
  return contents;
}

absl::StatusOr<JournalContents> CheckJournalFile(const std::string& file) {
  const auto named = [&](const absl::Status& status) {
    return absl::Status(status.code(), absl::StrFormat("%s: %s", file, status.message()));
  };
  if (access(file.c_str(), R_OK) != 0) return named(absl::NotFoundError("cannot be read"));
  auto database = SqliteDatabase::OpenToRead(file);
  if (!database.ok()) return named(database.status());
  absl::StatusOr<JournalContents> contents = CheckJournal(**database, Stop());
  if (!contents.ok()) return named(contents.status());
  return contents;
}

}  // namespace polyest::internal
