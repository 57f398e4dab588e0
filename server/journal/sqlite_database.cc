#include "server/journal/sqlite_database.h"

#include <absl/strings/str_format.h>
#include <sqlite3.h>

#include <cerrno>
#include <chrono>
#include <string>

#include "core/common/status.h"
#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {
namespace {

// Time after which somebody may have made room on a full disk.
constexpr std::chrono::seconds kFullDiskDelay{1};

absl::StatusCode CodeOf(int code) {
  switch (code & 0xff) {
    case SQLITE_FULL:
    case SQLITE_NOMEM:
      return absl::StatusCode::kResourceExhausted;
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
    case SQLITE_FORMAT:
      return absl::StatusCode::kDataLoss;
    case SQLITE_CONSTRAINT:
      return absl::StatusCode::kAlreadyExists;
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
    case SQLITE_IOERR:
    case SQLITE_CANTOPEN:
    case SQLITE_READONLY:
    case SQLITE_PERM:
    case SQLITE_AUTH:
    case SQLITE_PROTOCOL:
      return absl::StatusCode::kUnavailable;
    default:
      return absl::StatusCode::kInternal;
  }
}

// A value that is too large for SQLite. The statement that has it changes nothing, and the
// transaction goes on.
absl::Status TooLarge() {
  return Refuse(absl::StatusCode::kResourceExhausted,
                "the journal takes no more than 1 GB in one piece", {.reason = kLimitExceeded});
}

bool ConcernsOnlyItself(const absl::Status& status) {
  return absl::IsNotFound(status) || absl::IsAlreadyExists(status) ||
         absl::IsFailedPrecondition(status) || status == TooLarge();
}

}  // namespace

absl::Status FromSqlite(int code, std::string_view doing) {
  if (code == SQLITE_OK || code == SQLITE_ROW || code == SQLITE_DONE) return absl::OkStatus();
  if ((code & 0xff) == SQLITE_TOOBIG) return TooLarge();
  // The index of the write-ahead log cannot grow on a full disk either.
  if ((code & 0xff) == SQLITE_FULL || code == SQLITE_IOERR_SHMSIZE) return DiskFull();
  // No file of the process may be as large (ulimit -f). The write that failed has set errno, which
  // SQLite does not pass on for a commit.
  if ((code & 0xff) == SQLITE_IOERR && errno == EFBIG) return DiskFull();
  return absl::Status(CodeOf(code),
                      absl::StrFormat("%s: %s (SQLite %d)", doing, sqlite3_errstr(code), code));
}

absl::Status DiskFull() {
  return Refuse(absl::StatusCode::kResourceExhausted,
                "the disk is full, or the sessions on it are as large as they may be "
                "(--max-disk-mb)",
                {.reason = kDiskFull, .retry_delay = kFullDiskDelay});
}

bool IsDiskFull(const absl::Status& status) {
  const auto refusal = RefusalOf(status);
  return refusal && refusal->reason == kDiskFull;
}

absl::StatusOr<std::unique_ptr<SqliteDatabase>> SqliteDatabase::Open(const std::string& file) {
  return Open(file, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE);
}

absl::StatusOr<std::unique_ptr<SqliteDatabase>> SqliteDatabase::OpenToRead(
    const std::string& file) {
  return Open(file, SQLITE_OPEN_READONLY);
}

absl::StatusOr<std::unique_ptr<SqliteDatabase>> SqliteDatabase::Open(const std::string& file,
                                                                     int flags) {
  sqlite3* handle = nullptr;
  const int code = sqlite3_open_v2(file.c_str(), &handle, flags | SQLITE_OPEN_NOMUTEX, nullptr);
  std::unique_ptr<SqliteDatabase> database(new SqliteDatabase(handle));
  POLYEST_RETURN_IF_ERROR(FromSqlite(code, "opening the journal"));
  sqlite3_extended_result_codes(handle, 1);
  sqlite3_busy_timeout(handle, kBusyTimeoutMs);
  return database;
}

SqliteDatabase::~SqliteDatabase() {
  for (const auto& [sql, statement] : statements_) sqlite3_finalize(statement);
  sqlite3_close(database_);
}

absl::Status SqliteDatabase::Execute(const std::string& sql) {
  return FromSqlite(sqlite3_exec(database_, sql.c_str(), nullptr, nullptr, nullptr), "the journal");
}

absl::Status SqliteDatabase::Commit(
    const std::vector<std::function<absl::Status(SqliteDatabase&)>>& writes,
    std::vector<absl::Status>& outcomes) {
  const absl::Status written = WriteAll(writes, outcomes);
  if (!written.ok()) Execute("ROLLBACK").IgnoreError();
  return written;
}

absl::Status SqliteDatabase::WriteAll(
    const std::vector<std::function<absl::Status(SqliteDatabase&)>>& writes,
    std::vector<absl::Status>& outcomes) {
  POLYEST_RETURN_IF_ERROR(Execute("BEGIN IMMEDIATE"));
  for (size_t i = 0; i < writes.size(); ++i) {
    outcomes[i] = writes[i](*this);
    if (!outcomes[i].ok() && !ConcernsOnlyItself(outcomes[i])) return outcomes[i];
  }
  return Execute("COMMIT");
}

absl::StatusOr<int64_t> SqliteDatabase::Number(const std::string& sql) {
  sqlite3_stmt* statement = nullptr;
  int code = sqlite3_prepare_v2(database_, sql.c_str(), -1, &statement, nullptr);
  if (code == SQLITE_OK) code = sqlite3_step(statement);
  const int64_t number = code == SQLITE_ROW ? sqlite3_column_int64(statement, 0) : 0;
  sqlite3_finalize(statement);
  POLYEST_RETURN_IF_ERROR(FromSqlite(code, "the journal"));
  return number;
}

int64_t SqliteDatabase::last_insert_rowid() const { return sqlite3_last_insert_rowid(database_); }

int SqliteDatabase::changes() const { return sqlite3_changes(database_); }

absl::StatusOr<sqlite3_stmt*> SqliteDatabase::Prepare(const char* sql) {
  const auto found = statements_.find(sql);
  if (found != statements_.end()) return found->second;
  sqlite3_stmt* statement = nullptr;
  POLYEST_RETURN_IF_ERROR(FromSqlite(
      sqlite3_prepare_v3(database_, sql, -1, SQLITE_PREPARE_PERSISTENT, &statement, nullptr),
      "the journal"));
  statements_.emplace(sql, statement);
  return statement;
}

SqliteQuery::SqliteQuery(SqliteDatabase& database, const char* sql) {
  auto statement = database.Prepare(sql);
  if (statement.ok()) {
    statement_ = *statement;
  } else {
    failure_ = statement.status();
  }
}

SqliteQuery::~SqliteQuery() {
  if (statement_ == nullptr) return;
  sqlite3_reset(statement_);
  sqlite3_clear_bindings(statement_);
}

SqliteQuery& SqliteQuery::Bind(int64_t value) {
  if (failure_.ok()) {
    failure_ = FromSqlite(sqlite3_bind_int64(statement_, ++bound_, value), "the journal");
  }
  return *this;
}

SqliteQuery& SqliteQuery::Bind(double value) {
  if (failure_.ok()) {
    failure_ = FromSqlite(sqlite3_bind_double(statement_, ++bound_, value), "the journal");
  }
  return *this;
}

SqliteQuery& SqliteQuery::BindText(std::string_view text) {
  if (failure_.ok()) {
    failure_ = FromSqlite(sqlite3_bind_text64(statement_, ++bound_, text.data(), text.size(),
                                              SQLITE_STATIC, SQLITE_UTF8),
                          "the journal");
  }
  return *this;
}

SqliteQuery& SqliteQuery::BindBlob(std::string_view bytes) {
  if (failure_.ok()) {
    // A null pointer would bind NULL.
    const char* data = bytes.empty() ? "" : bytes.data();
    failure_ =
        FromSqlite(sqlite3_bind_blob64(statement_, ++bound_, data, bytes.size(), SQLITE_STATIC),
                   "the journal");
  }
  return *this;
}

absl::StatusOr<bool> SqliteQuery::Step() {
  POLYEST_RETURN_IF_ERROR(failure_);
  const int code = sqlite3_step(statement_);
  POLYEST_RETURN_IF_ERROR(FromSqlite(code, "the journal"));
  return code == SQLITE_ROW;
}

int64_t SqliteQuery::Integer(int column) const { return sqlite3_column_int64(statement_, column); }

double SqliteQuery::Real(int column) const { return sqlite3_column_double(statement_, column); }

std::string SqliteQuery::Bytes(int column) const {
  const void* data = sqlite3_column_blob(statement_, column);
  const int size = sqlite3_column_bytes(statement_, column);
  return data == nullptr ? std::string()
                         : std::string(static_cast<const char*>(data), static_cast<size_t>(size));
}

}  // namespace polyest::internal
