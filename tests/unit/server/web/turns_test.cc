#include "server/web/turns.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <string>
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
        const std::unique_ptr<Turns::Turn> turn = turns.Take(who);
        EXPECT_NE(turn, nullptr);
        EXPECT_EQ(++busy, 1);
        ++done;
        --busy;
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(done, 800);
}

TEST(Turns, EndTheWaitsAtAStopButNotTheTurn) {
  Turns turns;
  std::unique_ptr<Turns::Turn> turn = turns.Take("a");
  std::vector<std::thread> threads;
  std::atomic<int> refused = 0;
  for (const char* who : {"a", "a", "b", "b"}) {
    threads.emplace_back([&, who] { refused += turns.Take(who) == nullptr ? 1 : 0; });
  }
  turns.Stop();
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(refused, 4);
  EXPECT_EQ(turns.Take("c"), nullptr);
  turn = nullptr;
  EXPECT_EQ(turns.Take("c"), nullptr);
}

}  // namespace
}  // namespace polyest::internal
