// Which threads help with loops. Items that must meet before they go on prove that they run at the
// same time.

#include "core/common/thread_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <barrier>
#include <chrono>
#include <condition_variable>
#include <mutex>
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

// Where items meet that run at the same time.
class Meeting {
 public:
  explicit Meeting(int items) : awaited_(items) {}

  // Waits for the other items; returns whether all come.
  bool Await() {
    std::unique_lock lock(mutex_);
    --awaited_;
    came_.notify_all();
    return came_.wait_for(lock, std::chrono::minutes(1), [this] { return awaited_ == 0; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable came_;
  int awaited_;
};

// Returns whether a loop does so many items at the same time.
bool DoesAtOnce(ThreadPool& pool, int items) {
  Meeting meeting(items);
  std::atomic<int> met{0};
  pool.Run(items, items, [&](int) { met += meeting.Await() ? 1 : 0; });
  return met == items;
}

TEST(ThreadPool, HelpsOnAllCores) {
  ThreadPool pool(3);
  for (int loop = 0; loop < 20; ++loop) ASSERT_TRUE(DoesAtOnce(pool, 3));
}

// The threads wait for something other than a core, such as another machine.
TEST(ThreadPool, HelpsWithMoreThreadsThanCoresIfAsked) {
  ThreadPool pool(1);
  EXPECT_TRUE(DoesAtOnce(pool, 4));
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
  EXPECT_TRUE(DoesAtOnce(pool, 2));
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
  Meeting meeting(3);
  const auto fails = [&](int item) {
    EXPECT_TRUE(meeting.Await());  // on all threads
    if (item > 0) throw std::runtime_error("an item");
  };
  EXPECT_THROW(pool.Run(3, 3, fails), std::runtime_error);
  EXPECT_TRUE(DoesAtOnce(pool, 3));
}

}  // namespace
}  // namespace polyest::internal
