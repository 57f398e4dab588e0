#pragma once

// Where numerics run: a fixed number of threads behind a bounded queue, and strands, which run
// their own tasks in order and one at a time whatever the number of threads.

#include <absl/status/status.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace polyest {

using Task = std::function<void()>;

class Executor {
 public:
  // threads, capacity ≥ 1. `capacity` bounds the tasks that wait or run, those of strands among
  // them.
  Executor(int threads, int capacity);
  // Runs everything accepted, then joins.
  ~Executor();
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  // RESOURCE_EXHAUSTED when full; the task is then not run.
  absl::Status Submit(Task task);

 private:
  friend class Strand;

  // Room for one task, or RESOURCE_EXHAUSTED.
  absl::Status Reserve();
  void Release();
  // A task that has its room already.
  void Enqueue(Task task);
  void Run();

  const int capacity_;
  std::mutex mutex_;
  std::condition_variable ready_;
  std::deque<Task> queue_;
  int accepted_ = 0;
  bool ending_ = false;
  std::vector<std::jthread> threads_;
};

// Owned by a shared_ptr: its tasks keep it alive. The executor must outlive it.
class Strand : public std::enable_shared_from_this<Strand> {
 public:
  explicit Strand(Executor& executor) : executor_(executor) {}

  // As Executor::Submit, after every task submitted to this strand before.
  absl::Status Submit(Task task);

 private:
  void RunOne();

  Executor& executor_;
  std::mutex mutex_;
  std::deque<Task> tasks_;  // the first is running, or next
};

}  // namespace polyest
