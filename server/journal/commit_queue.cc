#include "server/journal/commit_queue.h"

#include <future>
#include <iterator>
#include <utility>

#include "core/common/status.h"

namespace polyest::internal {
namespace {

// Largest number of writes in one commit. It bounds what has to be written again when the commit
// fails, and how long others wait for it.
constexpr size_t kMaxWrites = 512;

bool ConcernsOnlyItself(const absl::Status& status) {
  return absl::IsNotFound(status) || absl::IsAlreadyExists(status) ||
         absl::IsFailedPrecondition(status);
}

}  // namespace

CommitQueue::CommitQueue(std::unique_ptr<SqliteDatabase> database, OnCommit on_commit)
    : database_(std::move(database)),
      on_commit_(std::move(on_commit)),
      thread_([this] { Serve(); }) {}

CommitQueue::~CommitQueue() {
  const std::lock_guard lock(mutex_);
  ending_ = true;
  submitted_.notify_one();
}

void CommitQueue::Submit(Write write, Done done) {
  const std::lock_guard lock(mutex_);
  queue_.push_back({std::move(write), std::move(done)});
  submitted_.notify_one();
}

void CommitQueue::SubmitLazily(Write write) {
  const std::lock_guard lock(mutex_);
  lazy_.push_back({std::move(write), [](const absl::Status&) {}});
}

void CommitQueue::Flush() {
  {
    const std::lock_guard lock(mutex_);
    if (lazy_.empty()) return;
  }
  Run([](SqliteDatabase&) { return absl::OkStatus(); }).IgnoreError();
}

absl::Status CommitQueue::Run(Write write) {
  std::promise<absl::Status> promise;
  auto outcome = promise.get_future();
  Submit(std::move(write), [&](const absl::Status& status) { promise.set_value(status); });
  return outcome.get();
}

void CommitQueue::Serve() {
  for (auto items = Take(); !items.empty(); items = Take()) Commit(std::move(items));
}

// Waits for writes and returns them; returns none at the end.
std::vector<CommitQueue::Item> CommitQueue::Take() {
  std::vector<Item> items;
  std::unique_lock lock(mutex_);
  submitted_.wait(lock, [this] { return !queue_.empty() || ending_; });
  while (!queue_.empty() && items.size() < kMaxWrites) {
    items.push_back(std::move(queue_.front()));
    queue_.pop_front();
  }
  std::move(lazy_.begin(), lazy_.end(), std::back_inserter(items));
  lazy_.clear();
  return items;
}

void CommitQueue::Commit(std::vector<Item> items) {
  const auto begin = std::chrono::steady_clock::now();
  std::vector<absl::Status> outcomes(items.size());
  const absl::Status committed = WriteAll(items, outcomes);
  if (!committed.ok()) database_->Execute("ROLLBACK").IgnoreError();
  if (on_commit_) {
    on_commit_({items.size(), std::chrono::steady_clock::now() - begin, committed});
  }
  for (size_t i = 0; i < items.size(); ++i) {
    items[i].done(committed.ok() ? outcomes[i] : committed);
  }
}

absl::Status CommitQueue::WriteAll(const std::vector<Item>& items,
                                   std::vector<absl::Status>& outcomes) {
  POLYEST_RETURN_IF_ERROR(database_->Execute("BEGIN IMMEDIATE"));
  for (size_t i = 0; i < items.size(); ++i) {
    outcomes[i] = items[i].write(*database_);
    if (!outcomes[i].ok() && !ConcernsOnlyItself(outcomes[i])) return outcomes[i];
  }
  return database_->Execute("COMMIT");
}

}  // namespace polyest::internal
