#pragma once

// Runs work, numerics above all: on threads behind a bounded queue that is shared fairly, and on
// strands, which run their own tasks in order and one at a time, whatever the number of threads.

#include <absl/status/status.h>

#include <chrono>
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
  int threads = 1;            // of all lanes together, ≥ threads_per_lane
  int capacity = 1;           // largest number of tasks that wait or run, on strands or not, ≥ 1
  int capacity_per_lane = 1;  // largest number of these in one lane, ≥ 1
  int niceness = 0;           // nice value added to the threads, ≥ 0
};

// Whether a task is refused when there is no room for it.
enum class Admission {
  kIfRoom,
  kAlways,  // for work that has begun, and whose owner bounds the number of its tasks
};

// Runs tasks in lanes. Lanes take turns, and no lane runs on more than threads_per_lane threads at
// a time: long tasks of one lane do not keep another from its turn, and the operating system shares
// the cores between the tasks that run. Thread-safe.
class Executor {
 public:
  explicit Executor(const ExecutorOptions& options);
  // Runs every task accepted, then joins the threads.
  ~Executor();
  Executor(const Executor&) = delete;
  Executor& operator=(const Executor&) = delete;

  // Submits a task to a lane. RESOURCE_EXHAUSTED when the queue is full; the task is then not run.
  absl::Status Submit(const std::string& lane, Task task, Admission admission = Admission::kIfRoom);
  // Waits until no task waits or runs. Returns false if some still do at the deadline.
  bool AwaitIdle(std::chrono::steady_clock::time_point deadline);
  int threads_per_lane() const { return options_.threads_per_lane; }
  // Returns the number of tasks that wait or run.
  int accepted() const;
  // Returns the number of tasks that wait.
  int waiting() const;

 private:
  friend class Strand;

  struct Lane {
    std::deque<Task> queue;
    int accepted = 0;
    int running = 0;
    bool in_turn = false;
  };
  // A thread of the executor sleeps until it is notified here.
  struct Worker {
    std::condition_variable woken;
    bool asleep = false;
  };

  // Takes room for one task; RESOURCE_EXHAUSTED when there is none.
  absl::Status Reserve(const std::string& lane, Admission admission);
  // Queues a task whose room has been taken. The room is given back after the task.
  void Enqueue(const std::string& lane, Task task);
  // Returns whether a thread may go on with another task of the strand whose task has ended,
  // because nobody waits for a thread or for the lane. If so, gives back the room of the task that
  // ended.
  bool GoOn(const std::string& lane);
  void Run(Worker& self);
  // Waits for a turn, or for the end.
  void Await(Worker& self, std::unique_lock<std::mutex>& lock);
  // The following are called with the mutex held.

  // Puts the lane among those that take turns, if it may run a task. Returns whether it did: a
  // thread must then be awake for it.
  bool GiveTurn(const std::string& name, Lane& lane);
  // Picks a thread that sleeps; null if none does. The caller notifies it, best without the mutex,
  // which it needs to wake up.
  Worker* Rouse();
  void WakeAll();

  const ExecutorOptions options_;
  mutable std::mutex mutex_;
  std::condition_variable idle_;
  std::map<std::string, Lane> lanes_;  // lanes that have tasks
  std::deque<std::string> turns_;
  int accepted_ = 0;
  bool ending_ = false;
  std::deque<Worker> workers_;
  // Those that sleep. The last one is woken first: its caches are warm.
  std::vector<Worker*> sleeping_;
  std::vector<std::jthread> threads_;
};

// Runs its tasks in order and one at a time. Owned by a shared_ptr, because its tasks keep it
// alive. The executor must outlive it. Thread-safe.
class Strand : public std::enable_shared_from_this<Strand> {
 public:
  Strand(Executor& executor, std::string lane) : executor_(executor), lane_(std::move(lane)) {}

  // Submits a task that runs after every task submitted to this strand before. RESOURCE_EXHAUSTED
  // when the executor's queue is full; the task is then not run.
  absl::Status Submit(Task task, Admission admission = Admission::kIfRoom);

 private:
  void Run();

  Executor& executor_;
  const std::string lane_;
  std::mutex mutex_;
  std::deque<Task> tasks_;  // the first one is running or is the next
};

}  // namespace polyest::internal
