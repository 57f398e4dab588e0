#pragma once

// Lends connections to a PostgreSQL database, a bounded number of them.

#include <absl/status/statusor.h>

#include <condition_variable>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "server/journal/postgres_connection.h"

namespace polyest::internal {

// Thread-safe.
class PostgresPool {
 public:
  // Largest number of connections.
  static constexpr int kConnections = 8;

  // A connection that is given back when this is destroyed.
  class Loan {
   public:
    Loan(PostgresPool& pool, std::unique_ptr<PostgresConnection> connection)
        : pool_(&pool), connection_(std::move(connection)) {}
    Loan(Loan&& other) noexcept = default;
    Loan& operator=(Loan&&) = delete;
    ~Loan() {
      if (connection_ != nullptr) pool_->GiveBack(std::move(connection_));
    }

    PostgresConnection& operator*() { return *connection_; }
    PostgresConnection* operator->() { return connection_.get(); }

   private:
    PostgresPool* pool_;
    std::unique_ptr<PostgresConnection> connection_;
  };

  explicit PostgresPool(PostgresTarget target) : target_(std::move(target)) {}

  // Returns a connection; waits for one while all are lent. UNAVAILABLE when none comes free or the
  // database is away.
  absl::StatusOr<Loan> Borrow();
  // Runs one statement on a connection. If that was lost while nobody used it, tries another one:
  // the statement must be one that may run twice.
  absl::StatusOr<PostgresResult> Query(const char* sql, const PostgresParameters& parameters = {});

 private:
  void GiveBack(std::unique_ptr<PostgresConnection> connection);
  // Closes the connections that are not lent.
  void DropIdle();

  const PostgresTarget target_;
  std::mutex mutex_;
  std::condition_variable returned_;
  std::vector<std::unique_ptr<PostgresConnection>> idle_;
  int lent_ = 0;
};

}  // namespace polyest::internal
