#include "server/journal/postgres_pool.h"

#include "core/common/status.h"
#include "server/journal/postgres_status.h"

namespace polyest::internal {

absl::StatusOr<PostgresPool::Loan> PostgresPool::Borrow() {
  {
    std::unique_lock lock(mutex_);
    const bool free = returned_.wait_for(lock, PostgresConnection::kAnswerTimeout,
                                         [this] { return lent_ < kConnections; });
    if (!free) return DatabaseAway("all connections for reading are in use");
    ++lent_;
    if (!idle_.empty()) {
      Loan loan(*this, std::move(idle_.back()));
      idle_.pop_back();
      return loan;
    }
  }
  auto opened = PostgresConnection::Open(target_);
  if (opened.ok()) return Loan(*this, *std::move(opened));
  GiveBack(nullptr);
  return opened.status();
}

void PostgresPool::GiveBack(std::unique_ptr<PostgresConnection> connection) {
  {
    const std::lock_guard lock(mutex_);
    --lent_;
    if (connection != nullptr && !connection->broken()) idle_.push_back(std::move(connection));
  }
  returned_.notify_one();
}

void PostgresPool::DropIdle() {
  std::vector<std::unique_ptr<PostgresConnection>> dropped;
  const std::lock_guard lock(mutex_);
  dropped.swap(idle_);
}

absl::StatusOr<PostgresResult> PostgresPool::Query(const char* sql,
                                                   const PostgresParameters& parameters) {
  absl::StatusOr<PostgresResult> result = DatabaseAway("no connection");
  for (int attempt = 0; attempt < 2; ++attempt) {
    POLYEST_ASSIGN_OR_RETURN(Loan connection, Borrow());
    result = connection->Query(sql, parameters);
    if (result.ok() || !connection->broken()) return result;
    // A server that was restarted has ended them all.
    DropIdle();
  }
  return result;
}

}  // namespace polyest::internal
