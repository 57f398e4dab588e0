#pragma once

// A parallel loop over independent items. Any thread may do any item, so items must not share what
// they write; then the result does not depend on the number of threads.

#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace polyest::internal {

// Calls work(item) once for each item of 0 … items − 1 on up to `threads` threads, the caller's
// included, and returns when all are done. The first exception that `work` throws ends the loop
// early and is rethrown here.
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

}  // namespace polyest::internal
