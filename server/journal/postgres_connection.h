#pragma once

// Wraps libpq: connections, which never wait without end, statements with parameters, and results.
// Values travel in the binary format.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <chrono>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/journal/postgres_target.h"

struct pg_conn;
struct pg_result;

namespace polyest::internal {

// Holds the values of a statement's parameters $1, $2, …, in this order.
class PostgresParameters {
 public:
  PostgresParameters& Add(int64_t value);  // bigint
  PostgresParameters& Add(double value);   // double precision
  PostgresParameters& AddFlag(bool value);
  // The text or bytes must stay valid until the statement has run.
  PostgresParameters& AddText(std::string_view text);
  PostgresParameters& AddBytes(std::string_view bytes);
  PostgresParameters& Add(const std::vector<int64_t>& values);  // bigint[], not empty

 private:
  friend class PostgresConnection;

  struct Value {
    const char* data() const { return outside != nullptr ? outside : inside.data(); }

    unsigned type = 0;  // PostgreSQL's number of the type
    std::string inside{};
    const char* outside = nullptr;
    int size = 0;
  };

  PostgresParameters& AddInside(unsigned type, std::string bytes);

  std::vector<Value> values_;
};

// Holds what a statement has given.
class PostgresResult {
 public:
  explicit PostgresResult(pg_result* result);

  // Returns how many rows it gave.
  int rows() const;
  // Returns how many rows it has inserted, changed or deleted.
  int64_t changes() const;
  // Returns the name of the command that has run, as the server says it: COMMIT, INSERT 0 1 …
  std::string_view command() const;

  // Return a value; 0 and nothing for NULL.
  int64_t Integer(int row, int column) const;
  double Real(int row, int column) const;
  bool Flag(int row, int column) const;
  std::string Bytes(int row, int column) const;

 private:
  std::unique_ptr<pg_result, void (*)(pg_result*)> result_;
};

// Is one row of a result, which must outlive it.
class PostgresRow {
 public:
  PostgresRow(const PostgresResult& result, int row) : result_(result), row_(row) {}

  int64_t Integer(int column) const { return result_.Integer(row_, column); }
  double Real(int column) const { return result_.Real(row_, column); }
  bool Flag(int column) const { return result_.Flag(row_, column); }
  std::string Bytes(int column) const { return result_.Bytes(row_, column); }

 private:
  const PostgresResult& result_;
  const int row_;
};

struct PostgresStatement {
  const char* sql;  // must live as long as the connection
  PostgresParameters parameters{};
};

// For use by one thread at a time. After an error other than the server's refusal of a statement
// the connection is broken and must not be used again.
class PostgresConnection {
 public:
  // Longest time that the server may work on a statement, or on those of a pipeline together.
  static constexpr std::chrono::seconds kStatementTimeout{10};
  // Longest time without an answer; longer than the server's own, so that it is the server that
  // gives up as long as it lives.
  static constexpr std::chrono::seconds kAnswerTimeout{15};

  // Connects to the server that takes writes. UNAVAILABLE when there is none; the details are in
  // the log.
  static absl::StatusOr<std::unique_ptr<PostgresConnection>> Open(const PostgresTarget& target);
  ~PostgresConnection();
  PostgresConnection(const PostgresConnection&) = delete;
  PostgresConnection& operator=(const PostgresConnection&) = delete;

  bool broken() const { return broken_; }
  // Returns whether the server has warned since this was last called.
  bool TakeWarning() { return std::exchange(warned_, false); }

  // Runs statements without parameters and results.
  absl::Status Execute(const std::string& sql);
  // Runs one statement, which is prepared once for each text.
  absl::StatusOr<PostgresResult> Query(const char* sql, const PostgresParameters& parameters = {});

  // Tells which statement of a pipeline the server has refused.
  struct Refused {
    size_t statement = 0;
    bool taken = false;  // a unique name is taken
  };
  // Sends all statements without waiting for answers in between and returns their results. When the
  // server refuses one, it runs none of those after it; `refused` then tells which it was.
  absl::StatusOr<std::vector<PostgresResult>> Pipeline(
      const std::vector<PostgresStatement>& statements, Refused& refused);

 private:
  explicit PostgresConnection(pg_conn* connection);
  absl::Status SetUp();
  // Returns the name of the prepared statement.
  absl::StatusOr<std::string> Prepare(const char* sql, const PostgresParameters& parameters);
  absl::Status SendPrepared(const std::string& name, const PostgresParameters& parameters);
  // Waits for the next result, which may be null.
  absl::StatusOr<pg_result*> Next(std::chrono::steady_clock::time_point deadline);
  // Returns the one result of the statement sent.
  absl::StatusOr<PostgresResult> Only();
  absl::Status ReadPipeline(size_t count, std::vector<PostgresResult>& results, Refused& refused);
  absl::Status Broken(std::string_view what);

  pg_conn* connection_;
  bool broken_ = false;
  bool warned_ = false;
  std::map<std::string_view, std::string> prepared_;  // names by texts
};

}  // namespace polyest::internal
