#include "server/journal/sqlite_schema.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <iterator>

#include "core/common/status.h"
#include "server/journal/session_digest.h"

namespace polyest::internal {
namespace {

// "poly" in the file's header, which identifies the file as a journal.
constexpr int64_t kApplicationId = 0x706f6c79;

// Migration i turns version i into version i + 1. Migrations that were released are never changed;
// new ones are added behind them.
constexpr const char* kMigrations[] = {
    // The columns place_* hold the place of the session after the batch. A rowid table with the
    // batches in the order of their arrival and a small index writes less than half of what a table
    // sorted by session would.
    R"(CREATE TABLE session (
         number INTEGER PRIMARY KEY AUTOINCREMENT,
         tenant TEXT NOT NULL,
         name TEXT NOT NULL,
         hidden INTEGER NOT NULL,
         created_s INTEGER NOT NULL,
         created_ns INTEGER NOT NULL,
         problem BLOB NOT NULL);
       CREATE UNIQUE INDEX session_by_name ON session (tenant, name) WHERE hidden = 0;
       CREATE TABLE batch (
         session INTEGER NOT NULL,
         sequence INTEGER NOT NULL,
         measurements BLOB NOT NULL,
         digest BLOB NOT NULL,
         place_samples INTEGER NOT NULL,
         place_rows INTEGER NOT NULL,
         place_run INTEGER NOT NULL,
         place_time_s REAL NOT NULL);
       CREATE UNIQUE INDEX batch_by_sequence ON batch (session, sequence);)",
    // The table `deleted` holds deleted sessions whose batches are still to be removed, a few at a
    // time.
    R"(CREATE TABLE snapshot (
         session INTEGER PRIMARY KEY,
         sequence INTEGER NOT NULL,
         rows INTEGER NOT NULL,
         state BLOB NOT NULL);
       CREATE TABLE deleted (session INTEGER PRIMARY KEY);)",
    R"(CREATE TABLE history (
         session INTEGER NOT NULL,
         ordinal INTEGER NOT NULL,
         sequence INTEGER NOT NULL,
         point BLOB NOT NULL,
         PRIMARY KEY (session, ordinal)) WITHOUT ROWID;)",
    "ALTER TABLE session ADD COLUMN reorder_window_s REAL NOT NULL DEFAULT 0;",
    // The digest of the session's row (session_digest.h).
    "ALTER TABLE session ADD COLUMN digest BLOB;",
    // The bytes of the measurements up to the batch; nobody asks for those of earlier batches.
    R"(ALTER TABLE batch ADD COLUMN place_bytes INTEGER NOT NULL DEFAULT 0;
       UPDATE batch SET place_bytes = (SELECT sum(length(measurements)) FROM batch AS other
         WHERE other.session = batch.session) WHERE sequence = (SELECT max(sequence)
         FROM batch AS other WHERE other.session = batch.session);)",
    // The parts of large batches but their last ones, and how many a batch has (batch_parts.h).
    R"(CREATE TABLE part (
         session INTEGER NOT NULL,
         sequence INTEGER NOT NULL,
         number INTEGER NOT NULL,
         bytes BLOB NOT NULL);
       CREATE UNIQUE INDEX part_by_number ON part (session, sequence, number);
       ALTER TABLE batch ADD COLUMN parts INTEGER NOT NULL DEFAULT 0;)",
};
constexpr int64_t kVersionWithDigests = 5;

absl::StatusOr<int64_t> CheckOwn(SqliteDatabase& database) {
  POLYEST_ASSIGN_OR_RETURN(const int64_t application, database.Number("PRAGMA application_id"));
  POLYEST_ASSIGN_OR_RETURN(const int64_t version, database.Number("PRAGMA user_version"));
  POLYEST_ASSIGN_OR_RETURN(const int64_t tables,
                           database.Number("SELECT count(*) FROM sqlite_schema"));
  if (application == 0 && version == 0 && tables == 0) return 0;
  if (application != kApplicationId) {
    return absl::FailedPreconditionError("is a database of another program");
  }
  if (version > JournalSchemaVersion()) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "has the format %d of a later version of polyest; this one knows formats up to %d", version,
        JournalSchemaVersion()));
  }
  return version;
}

absl::Status Migrate(SqliteDatabase& database, int64_t from, int to) {
  for (int64_t i = from; i < to; ++i) POLYEST_RETURN_IF_ERROR(database.Execute(kMigrations[i]));
  if (from < kVersionWithDigests && to >= kVersionWithDigests) {
    POLYEST_RETURN_IF_ERROR(WriteAllSessionDigests(database));
  }
  return database.Execute(
      absl::StrCat("PRAGMA application_id = ", kApplicationId, "; PRAGMA user_version = ", to));
}

}  // namespace

int JournalSchemaVersion() { return static_cast<int>(std::size(kMigrations)); }

absl::Status CheckJournalVersion(SqliteDatabase& database) {
  POLYEST_ASSIGN_OR_RETURN(const int64_t version, CheckOwn(database));
  if (version == JournalSchemaVersion()) return absl::OkStatus();
  if (version == 0) return absl::FailedPreconditionError("is empty");
  return absl::FailedPreconditionError(absl::StrFormat(
      "has the format %d of an earlier version of polyest; a daemon that opens it makes it format "
      "%d",
      version, JournalSchemaVersion()));
}

absl::Status PrepareSchema(SqliteDatabase& database, int version) {
  POLYEST_ASSIGN_OR_RETURN(const int64_t present, CheckOwn(database));
  if (present >= version) return absl::OkStatus();
  POLYEST_RETURN_IF_ERROR(database.Execute("BEGIN IMMEDIATE"));
  absl::Status migrated = Migrate(database, present, version);
  if (migrated.ok()) migrated = database.Execute("COMMIT");
  if (!migrated.ok()) database.Execute("ROLLBACK").IgnoreError();
  return migrated;
}

}  // namespace polyest::internal
