#pragma once

// The threads that help with parallel loops. They belong to the process and sleep between loops, so
// that a loop of a fraction of a millisecond gains by them, too.

#include <absl/functional/function_ref.h>

#include <condition_variable>
#include <mutex>
#include <thread>
#include <vector>

namespace polyest::internal {

// Counts the calling thread among those that compute while this object lives; a thread with several
// counts once. The pool's threads help only while there is a core for each thread that computes.
class Computing {
 public:
  Computing();
  ~Computing();
  Computing(const Computing&) = delete;
  Computing& operator=(const Computing&) = delete;
};

// Thread-safe.
class ThreadPool {
 public:
  // `cores` ≥ 1 are shared by threads that compute and threads that help.
  explicit ThreadPool(int cores);
  ~ThreadPool();  // no loop may run
  ThreadPool(const ThreadPool&) = delete;
  ThreadPool& operator=(const ThreadPool&) = delete;

  // Returns the pool of this process and its cores.
  static ThreadPool& OfProcess();

  // Calls work(item) once for each item of 0 … items − 1, on the calling thread and on those that
  // help it, and returns when all are done. At most `threads` take part, the caller included, and
  // fewer while there are not as many cores; but if `threads` is more than the cores, as for models
  // that wait for another machine, all of them may. Loops that run at the same time share the
  // helpers evenly. Threads come to help when the loop begins and when they have helped another
  // one, not when a core becomes free otherwise. The first exception that `work` throws ends the
  // loop early and is rethrown. The threads are made as they are first wanted, with the priority of
  // the caller.
  void Run(int items, int threads, absl::FunctionRef<void(int)> work);

 private:
  struct Loop;

  // With the mutex held.
  void MakeThreads(int count);
  Loop* LoopToHelp() const;

  void Help();

  const int cores_;
  std::mutex mutex_;
  std::condition_variable loop_waits_;
  std::condition_variable helper_left_;
  std::vector<Loop*> loops_;
  int helping_ = 0;
  bool ending_ = false;
  std::vector<std::jthread> threads_;
};

}  // namespace polyest::internal
