#pragma once

// Holds the address of a PostgreSQL database, as a connection URI of libpq.

#include <absl/status/statusor.h>

#include <string>

namespace polyest::internal {

class PostgresTarget {
 public:
  // Parses `postgresql://…`. INVALID_ARGUMENT, without the text of the URI, when libpq cannot read
  // it, and when it holds a password: passwords are read from the file that `passfile` or
  // PGPASSFILE names, so that no list of processes and no log shows them. FAILED_PRECONDITION when
  // libpq is not installed.
  static absl::StatusOr<PostgresTarget> Parse(const std::string& uri);

  const std::string& uri() const { return uri_; }

 private:
  explicit PostgresTarget(std::string uri) : uri_(std::move(uri)) {}

  std::string uri_;
};

// Returns whether a text is meant to be the URI of a PostgreSQL database.
bool IsPostgresUri(const std::string& text);

}  // namespace polyest::internal
