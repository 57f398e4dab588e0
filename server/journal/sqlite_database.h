#pragma once

// SQLite, wrapped once: connections and statements that clean up after themselves, and its codes as
// absl::Status. Messages say what happened and never where the file is: clients see them.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace polyest::internal {

// RESOURCE_EXHAUSTED: full; DATA_LOSS: damaged; ALREADY_EXISTS: not unique; UNAVAILABLE: the disk
// or a lock.
absl::Status FromSqlite(int code, std::string_view doing);

// One connection, for one thread at a time.
class SqliteDatabase {
 public:
  // Makes the file if there is none.
  static absl::StatusOr<std::unique_ptr<SqliteDatabase>> Open(const std::string& file);
  ~SqliteDatabase();
  SqliteDatabase(const SqliteDatabase&) = delete;
  SqliteDatabase& operator=(const SqliteDatabase&) = delete;

  // One or more statements without results.
  absl::Status Execute(const std::string& sql);
  // The number that a statement such as `PRAGMA user_version` gives.
  absl::StatusOr<int64_t> Number(const std::string& sql);
  int64_t last_insert_rowid() const;
  // Rows that the last statement has inserted, changed or deleted.
  int changes() const;
  sqlite3* handle() { return database_; }

 private:
  friend class SqliteQuery;

  explicit SqliteDatabase(sqlite3* database) : database_(database) {}
  // Prepared once for each text, which must outlive the connection.
  absl::StatusOr<sqlite3_stmt*> Prepare(const char* sql);

  sqlite3* database_;
  std::map<std::string_view, sqlite3_stmt*> statements_;
};

// One use of a statement. Parameters are bound in order; a failure along the way is what Step
// answers.
class SqliteQuery {
 public:
  SqliteQuery(SqliteDatabase& database, const char* sql);
  ~SqliteQuery();
  SqliteQuery(const SqliteQuery&) = delete;
  SqliteQuery& operator=(const SqliteQuery&) = delete;

  SqliteQuery& Bind(int64_t value);
  SqliteQuery& Bind(double value);
  // `bytes` must stay until the last Step.
  SqliteQuery& BindText(std::string_view text);
  SqliteQuery& BindBlob(std::string_view bytes);

  // True: there is a row, whose columns can be read until the next Step. False: no more rows.
  absl::StatusOr<bool> Step();
  // All steps of a statement without results.
  absl::Status Run() { return Step().status(); }

  int64_t Integer(int column) const;
  double Real(int column) const;
  std::string Bytes(int column) const;

 private:
  sqlite3_stmt* statement_ = nullptr;
  int bound_ = 0;
  absl::Status failure_;
};

}  // namespace polyest::internal
