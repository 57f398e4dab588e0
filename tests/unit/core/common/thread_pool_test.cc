// Which threads help with loops. Items that must meet before they go on prove that they run at the
// same time.

#include "core/common/thread_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <barrier>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

namespace polyest::internal {
namespace {

constexpr int kItems = 50;

// Returns the threads that did the items.
std::set<std::thread::id> ThreadsOf(ThreadPool& pool, int items, int threads) {
  std::vector<std::thread::id> of_item(static_cast<size_t>(items));
  pool.Run(items, threads,
           [&](int item) { of_item[static_cast<size_t>(item)] = std::this_thread::get_id(); });
  return {of_item.begin(), of_item.end()};
}

TEST(ThreadPool, HelpsOnAllCores) {
  ThreadPool pool(3);
  std::barrier<> met(3);
  for (int loop = 0; loop < 20; ++loop) {
    pool.Run(3, 3, [&](int) { met.arrive_and_wait(); });
  }
}

// The threads wait for something other than a core, such as another machine.
TEST(ThreadPool, HelpsWithMoreThreadsThanCoresIfAsked) {
  ThreadPool pool(1);
  std::barrier<> met(4);
  pool.Run(4, 4, [&](int) { met.arrive_and_wait(); });
}

TEST(ThreadPool, UsesNoMoreThreadsThanAsked) {
  ThreadPool pool(8);
  for (int loop = 0; loop < kItems; ++loop) EXPECT_LE(ThreadsOf(pool, kItems, 2).size(), 2u);
}

TEST(ThreadPool, LeavesACoreToEachThreadThatComputes) {
  ThreadPool pool(2);
  std::barrier<> begun(2), done(2);
  std::jthread other([&] {
    const Computing here;
    const Computing counted_once;
    begun.arrive_and_wait();
    done.arrive_and_wait();
  });
  begun.arrive_and_wait();
  for (int loop = 0; loop < kItems; ++loop) {
    EXPECT_EQ(ThreadsOf(pool, kItems, 2), std::set{std::this_thread::get_id()});
  }
  done.arrive_and_wait();
  other.join();
  std::barrier<> met(2);
  pool.Run(2, 2, [&](int) { met.arrive_and_wait(); });
}

TEST(ThreadPool, ServesLoopsWithinLoopsAndSideBySide) {
  ThreadPool pool(4);
  std::atomic<int> done{0};
  const auto nested = [&](int) { pool.Run(kItems, 3, [&](int) { ++done; }); };
  {
    std::vector<std::jthread> callers;
    for (int caller = 0; caller < 3; ++caller) {
      callers.emplace_back([&] { pool.Run(kItems, 4, nested); });
    }
  }
  EXPECT_EQ(done, 3 * kItems * kItems);
}

TEST(ThreadPool, GoesOnAfterAnException) {
  ThreadPool pool(3);
  std::barrier<> met(3);
  const auto fails = [&](int item) {
    met.arrive_and_wait();  // on all threads
    if (item > 0) throw std::runtime_error("an item");
  };
  EXPECT_THROW(pool.Run(3, 3, fails), std::runtime_error);
  pool.Run(3, 3, [&](int) { met.arrive_and_wait(); });
}

}  // namespace
}  // namespace polyest::internal
