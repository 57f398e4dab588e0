#include "core/common/parallel.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace polyest::internal {
namespace {

TEST(ParallelFor, DoesEachItemOnceForAnyNumberOfThreads) {
  for (const int threads : {1, 2, 3, 16}) {
    std::vector<int> done(10, 0);
    ParallelFor(10, threads, [&](int item) { ++done[item]; });
    EXPECT_EQ(done, std::vector<int>(10, 1)) << threads;
  }
  ParallelFor(0, 4, [](int) { FAIL(); });
}

TEST(ParallelFor, ThrowsAgainWhatAnItemThrew) {
  for (const int threads : {1, 3}) {
    EXPECT_THROW(ParallelFor(8, threads,
                             [](int item) {
                               if (item == 5) throw std::runtime_error("five");
                             }),
                 std::runtime_error);
  }
}

}  // namespace
}  // namespace polyest::internal
