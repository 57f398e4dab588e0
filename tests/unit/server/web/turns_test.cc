#include "server/web/turns.h"

#include <gtest/gtest.h>

#include <thread>
#include <vector>

namespace polyest::internal {
namespace {

TEST(Turns, AreTakenByOneAtATime) {
  Turns turns;
  int busy = 0;
  int done = 0;
  std::vector<std::thread> threads;
  for (int i = 0; i < 8; ++i) {
    threads.emplace_back([&, who = std::to_string(i % 3)] {
      for (int k = 0; k < 100; ++k) {
        const Turns::Turn turn = turns.Take(who);
        EXPECT_EQ(++busy, 1);
        ++done;
        --busy;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(done, 800);
}

}  // namespace
}  // namespace polyest::internal
