#pragma once

// A parallel loop over independent items. Which thread does which item is left to chance, so items
// must not share anything they write; then the result is the same for any number of threads.

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace polyest {

// Calls work(item) once for each item of 0 … items − 1 on up to `threads` threads, the caller's
// among them, and returns when all are done. The first exception thrown by work ends the loop
// early and is thrown again here.
template <typename Work>
void ParallelFor(int items, int threads, const Work& work) {
  threads = std::min(threads, items);
  if (threads <= 1) {
    for (int item = 0; item < items; ++item) work(item);
    return;
  }
  std::atomic<int> next{0};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto run = [&] {
    try {
      for (int item = next++; item < items; item = next++) work(item);
    } catch (...) {
      next = items;
      const std::lock_guard lock(failure_mutex);
      if (!failure) failure = std::current_exception();
    }
  };
  {
    std::vector<std::jthread> helpers;
    for (int thread = 1; thread < threads; ++thread) helpers.emplace_back(run);
    run();
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace polyest
