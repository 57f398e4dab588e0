#pragma once

// Wraps SQLite: connections and statements that clean up after themselves, and its codes as
// absl::Status. Messages say what happened but never where the file is, because clients see them.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

struct sqlite3;
struct sqlite3_stmt;

namespace polyest::internal {

// Returns the status of an SQLite code, just after the call that returned it: RESOURCE_EXHAUSTED
// when the disk or the memory is full or a value or a file is too large, DATA_LOSS when the file is
// damaged, ALREADY_EXISTS when a constraint fails, UNAVAILABLE when the disk or a lock fails,
// INTERNAL otherwise. `doing` says in the message what was tried.
absl::Status FromSqlite(int code, std::string_view doing);

// Returns how a full disk refuses what is to be written.
absl::Status DiskFull();
// Returns whether a status is that of a full disk, or of a database that is as large as it may be.
bool IsDiskFull(const absl::Status& status);

// Longest wait of a connection for a lock that another one of this process holds for a moment.
inline constexpr int kBusyTimeoutMs = 10'000;

// Owns one connection, for use by one thread at a time.
class SqliteDatabase {
 public:
  // Opens a file; makes it if there is none.
  static absl::StatusOr<std::unique_ptr<SqliteDatabase>> Open(const std::string& file);
  // Opens a file that nobody writes to; never changes it.
  static absl::StatusOr<std::unique_ptr<SqliteDatabase>> OpenToRead(const std::string& file);
  ~SqliteDatabase();
  SqliteDatabase(const SqliteDatabase&) = delete;
  SqliteDatabase& operator=(const SqliteDatabase&) = delete;

  // Runs one or more statements without results.
  absl::Status Execute(const std::string& sql);
  // Makes changes in one transaction, all of them or, if it returns an error, none; sets the
  // outcome of each. A change that returns NOT_FOUND, ALREADY_EXISTS or FAILED_PRECONDITION, or
  // that has a value too large for SQLite, has changed nothing, and the others are committed; any
  // other error undoes them all.
  absl::Status Commit(const std::vector<std::function<absl::Status(SqliteDatabase&)>>& writes,
                      std::vector<absl::Status>& outcomes);
  // Returns the number that a statement such as `PRAGMA user_version` gives.
  absl::StatusOr<int64_t> Number(const std::string& sql);
  int64_t last_insert_rowid() const;
  // Returns how many rows the last statement has inserted, changed or deleted.
  int changes() const;
  sqlite3* handle() { return database_; }

 private:
  friend class SqliteQuery;

  // `flags` are those of SQLite.
  static absl::StatusOr<std::unique_ptr<SqliteDatabase>> Open(const std::string& file, int flags);
  explicit SqliteDatabase(sqlite3* database) : database_(database) {}
  // Returns the statement for `sql`, which is prepared once for each text. The text must outlive
  // the connection.
  absl::StatusOr<sqlite3_stmt*> Prepare(const char* sql);
  absl::Status WriteAll(const std::vector<std::function<absl::Status(SqliteDatabase&)>>& writes,
                        std::vector<absl::Status>& outcomes);

  sqlite3* database_;
  std::map<std::string_view, sqlite3_stmt*> statements_;
};

// Uses a statement once. Parameters are bound in order; Step returns an error in binding them.
class SqliteQuery {
 public:
  SqliteQuery(SqliteDatabase& database, const char* sql);
  ~SqliteQuery();
  SqliteQuery(const SqliteQuery&) = delete;
  SqliteQuery& operator=(const SqliteQuery&) = delete;

  SqliteQuery& Bind(int64_t value);
  SqliteQuery& Bind(double value);
  // The text or bytes bound must stay valid until the last Step.
  SqliteQuery& BindText(std::string_view text);
  SqliteQuery& BindBlob(std::string_view bytes);

  // Goes to the next row. Returns true when there is one, whose columns can be read until the next
  // Step, and false when there are no more rows.
  absl::StatusOr<bool> Step();
  // Runs a statement without results.
  absl::Status Run() { return Step().status(); }

  // Return a column of the present row.
  int64_t Integer(int column) const;
  double Real(int column) const;
  bool Flag(int column) const { return Integer(column) != 0; }
  std::string Bytes(int column) const;

 private:
  sqlite3_stmt* statement_ = nullptr;
  int bound_ = 0;
  absl::Status failure_;
};

}  // namespace polyest::internal
