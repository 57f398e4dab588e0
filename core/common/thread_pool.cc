#include "core/common/thread_pool.h"

#include <algorithm>
#include <atomic>
#include <exception>
#include <system_error>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

std::atomic<int> computing{0};        // number of threads that compute
thread_local int computing_here = 0;  // number of the calling thread's Computing objects

}  // namespace

Computing::Computing() {
  if (computing_here++ == 0) ++computing;
}

Computing::~Computing() {
  if (--computing_here == 0) --computing;
}

struct ThreadPool::Loop {
  absl::FunctionRef<void(int)> work;
  const int items;
  const int threads;
  std::atomic<int> next{0};
  // The pool's mutex guards these.
  int helpers = 0;
  std::exception_ptr failure = nullptr;  // the first

  bool HasItems() const { return next.load(std::memory_order_relaxed) < items; }

  void DoItems(std::mutex& mutex) {
    try {
      for (int item = next++; item < items; item = next++) work(item);
    } catch (...) {
      next = items;
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
    }
  }
};

ThreadPool::ThreadPool(int cores) : cores_(cores) { POLYEST_CHECK(cores >= 1); }

ThreadPool::~ThreadPool() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  loop_waits_.notify_all();
}

ThreadPool& ThreadPool::OfProcess() {
  // Never destroyed, because a thread may still compute when the process exits.
  static auto* const pool =
      new ThreadPool(std::max(1, static_cast<int>(std::thread::hardware_concurrency())));
  return *pool;
}

void ThreadPool::Run(int items, int threads, absl::FunctionRef<void(int)> work) {
  const Computing here;
  Loop loop{work, items, threads};
  int helpers = std::min(threads, items) - 1;
  {
    const std::lock_guard lock(mutex_);
    MakeThreads(helpers);
    loops_.push_back(&loop);
    helpers = std::min(helpers, std::max(cores_, threads) - computing - helping_);
  }
  for (int helper = 0; helper < helpers; ++helper) loop_waits_.notify_one();
  loop.DoItems(mutex_);
  std::unique_lock lock(mutex_);
  std::erase(loops_, &loop);
  helper_left_.wait(lock, [&] { return loop.helpers == 0; });
  if (loop.failure) std::rethrow_exception(loop.failure);
}

void ThreadPool::MakeThreads(int count) {
  try {
    while (std::ssize(threads_) < count) threads_.emplace_back([this] { Help(); });
  } catch (const std::system_error&) {
    // The system allows no more threads: those that there are do the loop.
  }
}

// Returns the loop with the fewest helpers of those that have work for another one; null if there
// is none.
ThreadPool::Loop* ThreadPool::LoopToHelp() const {
  Loop* least = nullptr;
  for (Loop* const loop : loops_) {
    const bool has_core = computing + helping_ < std::max(cores_, loop->threads);
    if (!has_core || loop->helpers + 1 >= loop->threads || !loop->HasItems()) continue;
    if (least == nullptr || loop->helpers < least->helpers) least = loop;
  }
  return least;
}

void ThreadPool::Help() {
  ++computing_here;  // helping_ counts this thread; a loop within an item must not count it again
  std::unique_lock lock(mutex_);
  while (true) {
    Loop* loop = nullptr;
    loop_waits_.wait(lock, [&] { return ending_ || (loop = LoopToHelp()) != nullptr; });
    if (loop == nullptr) return;
    ++loop->helpers;
    ++helping_;
    lock.unlock();
    loop->DoItems(mutex_);
    lock.lock();
    --helping_;
    if (--loop->helpers == 0) helper_left_.notify_all();
  }
}

}  // namespace polyest::internal
