#include "server/execution/executor.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <latch>
#include <memory>
#include <utility>
#include <vector>

namespace polyest::internal {
namespace {

constexpr char kLane[] = "lane";

ExecutorOptions OneLane(int threads, int capacity) {
  return {.threads_per_lane = threads,
          .threads = threads,
          .capacity = capacity,
          .capacity_per_lane = capacity,
          .niceness = 0};
}

TEST(Executor, RunsEverythingAcceptedBeforeItEnds) {
  std::atomic<int> ran{0};
  {
    Executor executor(OneLane(2, 100));
    for (int i = 0; i < 100; ++i) ASSERT_TRUE(executor.Submit(kLane, [&] { ++ran; }).ok());
  }
  EXPECT_EQ(ran, 100);
}

TEST(Executor, GivesWayToOtherThreadsWhenItIsTold) {
  ExecutorOptions options = OneLane(1, 1);
  options.niceness = 7;
  int niceness = 0;
  const int own = getpriority(PRIO_PROCESS, 0);
  {
    Executor executor(options);
    ASSERT_TRUE(executor.Submit(kLane, [&] { niceness = getpriority(PRIO_PROCESS, 0); }).ok());
  }
  EXPECT_EQ(niceness, std::min(own + 7, 19));
  EXPECT_EQ(getpriority(PRIO_PROCESS, 0), own);
}

TEST(Executor, RefusesMoreThanItsCapacityAndTakesMoreLater) {
  std::latch started(1), go_on(1), second_ran(1);
  Executor executor(OneLane(1, 2));
  ASSERT_TRUE(executor
                  .Submit(kLane,
                          [&] {
                            started.count_down();
                            go_on.wait();
                          })
                  .ok());
  started.wait();
  ASSERT_TRUE(executor.Submit(kLane, [&] { second_ran.count_down(); }).ok());
  const absl::Status refused = executor.Submit(kLane, [] { FAIL() << "was refused"; });
  EXPECT_EQ(refused.code(), absl::StatusCode::kResourceExhausted);
  EXPECT_EQ(refused.message(), "the daemon is busy: its queue of 2 tasks is full; try later");
  // A strand shares the capacity.
  EXPECT_FALSE(std::make_shared<Strand>(executor, kLane)->Submit([] {}).ok());
  go_on.count_down();
  second_ran.wait();
  // The second task has run but may not have left yet; one place is free in any case.
  EXPECT_TRUE(executor.Submit(kLane, [] {}).ok());
}

TEST(Executor, RefusesNoTaskOfWorkThatHasBegun) {
  std::latch go_on(1), ran(2);
  Executor executor(OneLane(1, 1));
  ASSERT_TRUE(executor.Submit(kLane, [&] { go_on.wait(); }).ok());
  EXPECT_FALSE(executor.Submit(kLane, [] {}).ok());
  const auto count = [&] { ran.count_down(); };
  EXPECT_TRUE(executor.Submit(kLane, count, Admission::kAlways).ok());
  EXPECT_TRUE(std::make_shared<Strand>(executor, kLane)->Submit(count, Admission::kAlways).ok());
  EXPECT_EQ(executor.accepted(), 3);
  EXPECT_FALSE(executor.Submit(kLane, [] {}).ok());
  go_on.count_down();
  ran.wait();
}

TEST(Executor, SaysWhetherItHasBecomeIdle) {
  std::latch go_on(1);
  Executor executor(OneLane(1, 2));
  EXPECT_TRUE(executor.AwaitIdle(std::chrono::steady_clock::now()));
  ASSERT_TRUE(executor.Submit(kLane, [&] { go_on.wait(); }).ok());
  EXPECT_FALSE(executor.AwaitIdle(std::chrono::steady_clock::now()));
  go_on.count_down();
  EXPECT_TRUE(executor.AwaitIdle(std::chrono::steady_clock::now() + std::chrono::hours(1)));
}

TEST(Executor, RunsTasksAtTheSameTimeOnItsThreads) {
  std::latch both(2);  // opens only when two tasks run at once
  Executor executor(OneLane(2, 2));
  for (int i = 0; i < 2; ++i)
    ASSERT_TRUE(executor.Submit(kLane, [&] { both.arrive_and_wait(); }).ok());
  both.wait();
}

TEST(Executor, KeepsAThreadForOthersWhileOneLaneIsBusyWithLongTasks) {
  std::latch end(1), long_one_runs(1), other_ran(1);
  const auto long_task = [&](bool first) {
    if (first) long_one_runs.count_down();
    end.wait();
  };
  Executor executor({.threads_per_lane = 1, .threads = 2, .capacity = 10, .capacity_per_lane = 10});
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(executor.Submit("long", [&, i] { long_task(i == 0); }).ok());
  }
  long_one_runs.wait();
  ASSERT_TRUE(executor.Submit("other", [&] { other_ran.count_down(); }).ok());
  other_ran.wait();
  end.count_down();
}

TEST(Executor, LetsLanesTakeTurns) {
  std::vector<char> order;
  {
    std::latch go_on(1), started(1);
    Executor executor(OneLane(1, 10));
    const auto first = [&] {
      started.count_down();
      go_on.wait();
    };
    ASSERT_TRUE(executor.Submit("x", first).ok());
    started.wait();
    for (int i = 0; i < 3; ++i) {
      ASSERT_TRUE(executor.Submit("a", [&] { order.push_back('a'); }).ok());
    }
    ASSERT_TRUE(executor.Submit("b", [&] { order.push_back('b'); }).ok());
    go_on.count_down();
  }
  EXPECT_EQ(order, (std::vector<char>{'a', 'b', 'a', 'a'}));
}

TEST(Executor, KeepsRoomForOthersWhenOneLaneIsFull) {
  std::latch end(1);
  Executor executor({.threads_per_lane = 1, .threads = 1, .capacity = 3, .capacity_per_lane = 2});
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(executor.Submit("a", [&] { end.wait(); }).ok());
  EXPECT_EQ(executor.Submit("a", [] {}).message(),
            "the daemon is busy: its queue of 2 tasks is full; try later");
  EXPECT_TRUE(executor.Submit("b", [] {}).ok());
  EXPECT_EQ(executor.accepted(), 3);
  end.count_down();
}

TEST(Executor, CountsATaskUntilNothingIsLeftOfIt) {
  std::promise<std::pair<int, int>> counts;
  Executor executor(OneLane(1, 1));
  const auto count = [&](void*) { counts.set_value({executor.accepted(), executor.waiting()}); };
  // The captured pointer is destroyed with the task, and its deleter counts then.
  const absl::Status accepted =
      executor.Submit(kLane, [held = std::shared_ptr<void>(nullptr, count)] {});
  ASSERT_TRUE(accepted.ok()) << accepted;
  EXPECT_EQ(counts.get_future().get(), std::pair(1, 0));
}

TEST(Strand, RunsItsTasksInOrderAndOneAtATime) {
  constexpr int kStrands = 5, kTasks = 200;
  std::vector<std::vector<int>> order(kStrands);
  std::atomic<int> overlaps{0};
  {
    Executor executor(OneLane(4, kStrands * kTasks));
    for (auto& seen : order) {
      auto strand = std::make_shared<Strand>(executor, kLane);
      auto inside = std::make_shared<std::atomic<int>>(0);
      for (int task = 0; task < kTasks; ++task) {
        ASSERT_TRUE(strand
                        ->Submit([&seen, &overlaps, inside, task] {
                          if (inside->fetch_add(1) != 0) ++overlaps;
                          seen.push_back(task);
                          inside->fetch_sub(1);
                        })
                        .ok());
      }
    }
  }
  EXPECT_EQ(overlaps, 0);
  for (const auto& seen : order) {
    ASSERT_EQ(seen.size(), static_cast<size_t>(kTasks));
    for (int task = 0; task < kTasks; ++task) EXPECT_EQ(seen[static_cast<size_t>(task)], task);
  }
}

TEST(Strand, LetsOthersHaveTheirTurnBetweenItsTasks) {
  std::vector<char> order;
  {
    std::latch go_on(1);
    Executor executor(OneLane(1, 10));
    ASSERT_TRUE(executor.Submit(kLane, [&] { go_on.wait(); }).ok());
    auto a = std::make_shared<Strand>(executor, kLane);
    auto b = std::make_shared<Strand>(executor, kLane);
    for (int i = 0; i < 2; ++i) ASSERT_TRUE(a->Submit([&] { order.push_back('a'); }).ok());
    for (int i = 0; i < 2; ++i) ASSERT_TRUE(b->Submit([&] { order.push_back('b'); }).ok());
    go_on.count_down();
  }
  EXPECT_EQ(order, (std::vector<char>{'a', 'b', 'a', 'b'}));
}

TEST(Strand, TakesTasksFromItsOwnTasks) {
  int ran = 0;
  {
    Executor executor(OneLane(1, 10));
    auto strand = std::make_shared<Strand>(executor, kLane);
    ASSERT_TRUE(strand
                    ->Submit([&ran, strand] {
                      ++ran;
                      EXPECT_TRUE(strand->Submit([&ran] { ++ran; }).ok());
                    })
                    .ok());
  }
  EXPECT_EQ(ran, 2);
}

}  // namespace
}  // namespace polyest::internal
