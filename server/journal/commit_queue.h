#pragma once

// One thread that writes: what has come while it was committing goes into its next commit, so that
// one wait for the disk serves many.

#include <absl/status/status.h>

#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "server/journal/sqlite_database.h"

namespace polyest::internal {

struct CommitReport {
  size_t writes = 0;
  std::chrono::duration<double> duration{0};
  absl::Status outcome;
};

class CommitQueue {
 public:
  // NOT_FOUND, ALREADY_EXISTS and FAILED_PRECONDITION mean that it has changed nothing and others
  // may be committed; anything else undoes the whole commit.
  using Write = std::function<absl::Status(SqliteDatabase&)>;
  // Once, from the writing thread: OK when it is on disk.
  using Done = std::function<void(const absl::Status&)>;

  // After each commit, before those who wait for it hear of it; must not wait.
  using OnCommit = std::function<void(const CommitReport&)>;

  explicit CommitQueue(std::unique_ptr<SqliteDatabase> database, OnCommit on_commit = {});
  // Writes what was submitted.
  ~CommitQueue();
  CommitQueue(const CommitQueue&) = delete;
  CommitQueue& operator=(const CommitQueue&) = delete;

  // In the order of the calls.
  void Submit(Write write, Done done);
  // Submits and waits.
  absl::Status Run(Write write);

 private:
  struct Item {
    Write write;
    Done done;
  };

  void Serve();
  std::vector<Item> Take();
  void Commit(std::vector<Item> items);
  absl::Status WriteAll(const std::vector<Item>& items, std::vector<absl::Status>& outcomes);

  std::unique_ptr<SqliteDatabase> database_;
  const OnCommit on_commit_;
  std::mutex mutex_;
  std::condition_variable submitted_;
  std::deque<Item> queue_;
  bool ending_ = false;
  std::jthread thread_;
};

}  // namespace polyest::internal
