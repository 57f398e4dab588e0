#pragma once

// Where work runs, numerics above all: threads behind a bounded queue, shared fairly, and strands,
// which run their own tasks in order and one at a time whatever the number of threads.

#include <absl/status/status.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace polyest::internal {

using Task = std::function<void()>;

struct ExecutorOptions {
  int threads_per_lane = 1;   // ≥ 1
  int threads = 1;            // in all, ≥ threads_per_lane
  int capacity = 1;           // tasks that wait or run, those of strands among them, ≥ 1
  int capacity_per_lane = 1;  // of these, one lane's, ≥ 1
  int niceness = 0;           // of its threads, ≥ 0: how much they give way to others
};

// Every task belongs to a lane. Lanes take turns, and no lane runs on more than threads_per_lane
// threads at a time: long tasks of one do not keep another from its turn, and the operating system
// shares the cores between those that run.
class Executor {
 public:
  explicit Executor(const ExecutorOptions& options);
  // Runs everything accepted, then joins.
  ~Executor();
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  // RESOURCE_EXHAUSTED when full; the task is then not run.
  absl::Status Submit(const std::string& lane, Task task);
  // Tasks that wait or run.
  int accepted() const;
  // Of these, those that wait.
  int waiting() const;

 private:
  friend class Strand;

  struct Lane {
    std::deque<Task> queue;
    int accepted = 0;
    int running = 0;
    bool in_turn = false;
  };

  // Room for one task, or RESOURCE_EXHAUSTED.
  absl::Status Reserve(const std::string& lane);
  void Release(const std::string& lane);
  // A task that has its room already.
  void Enqueue(const std::string& lane, Task task);
  void Run();
  // With the mutex held: puts the lane among those that take turns, if it may run a task.
  void GiveTurn(const std::string& name, Lane& lane);

  const ExecutorOptions options_;
  mutable std::mutex mutex_;
  std::condition_variable ready_;
  std::map<std::string, Lane> lanes_;  // those with tasks
  std::deque<std::string> turns_;
  int accepted_ = 0;
  bool ending_ = false;
  std::vector<std::jthread> threads_;
};

// Owned by a shared_ptr: its tasks keep it alive. The executor must outlive it.
class Strand : public std::enable_shared_from_this<Strand> {
 public:
  Strand(Executor& executor, std::string lane) : executor_(executor), lane_(std::move(lane)) {}

  // As Executor::Submit, after every task submitted to this strand before.
  absl::Status Submit(Task task);

 private:
  void RunOne();

  Executor& executor_;
  const std::string lane_;
  std::mutex mutex_;
  std::deque<Task> tasks_;  // the first is running, or next
};

}  // namespace polyest::internal
