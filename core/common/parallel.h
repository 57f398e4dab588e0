#pragma once

// A parallel loop over independent items. Any thread may do any item, so items must not share what
// they write; then the result does not depend on the number of threads.

#include <cstdint>

#include "core/common/thread_pool.h"

namespace polyest::internal {

// Returns 1 for work of fewer floating-point operations than pay for waking another thread, which
// takes as long as some 10⁵ of them; otherwise `threads`.
inline int ThreadsFor(int64_t operations, int threads) {
  constexpr int64_t kWorthWaking = 300'000;
  return operations < kWorthWaking ? 1 : threads;
}

// Calls work(item) once for each item of 0 … items − 1 on up to `threads` threads, the caller's
// included, and returns when all are done. The first exception that `work` throws ends the loop
// early and is rethrown here.
template <typename Work>
void ParallelFor(int items, int threads, const Work& work) {
  if (threads > 1 && items > 1) {
    ThreadPool::OfProcess().Run(items, threads, work);
  } else {
    for (int item = 0; item < items; ++item) work(item);
  }
}

}  // namespace polyest::internal
