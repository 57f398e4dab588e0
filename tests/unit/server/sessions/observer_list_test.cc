#include "server/sessions/observer_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <future>

#include "tests/unit/server/sessions/counting_observer.h"

namespace polyest::internal {
namespace {

class ObserverListTest : public testing::Test {
 protected:
  void Await() { executor_.AwaitIdle(std::chrono::steady_clock::time_point::max()); }
  static SharedEstimate EstimateOf(int64_t sequence) {
    auto estimate = std::make_shared<v1::Estimate>();
    estimate->set_sequence(sequence);
    return estimate;
  }

  Executor executor_{{}};
  const std::shared_ptr<ObserverList> list_ =
      std::make_shared<ObserverList>("sessions/a", executor_, "t/sessions");
  const std::shared_ptr<CountingObserver> first_ = std::make_shared<CountingObserver>();
  const std::shared_ptr<CountingObserver> second_ = std::make_shared<CountingObserver>();
};

TEST_F(ObserverListTest, GivesAnEstimateToAllWhoWatchAndToNobodyTwice) {
  const SharedEstimate one = EstimateOf(1), two = EstimateOf(2);
  ASSERT_TRUE(list_->Add(first_).ok());
  list_->Announce(one);
  Await();
  ASSERT_TRUE(list_->Add(second_).ok());
  list_->Announce(one);
  Await();
  list_->Remove(first_.get());
  list_->Announce(two);
  Await();
  list_->Announce(one);  // comes too late
  Await();
  EXPECT_THAT(first_->estimates, testing::ElementsAre(one));
  EXPECT_THAT(second_->estimates, testing::ElementsAre(one, two));
  EXPECT_EQ(list_->size(), 1u);
}

TEST_F(ObserverListTest, KeepsNobodyWaitingWhoAnnounces) {
  // The only thread is occupied, and the queue is full, until the test lets it go.
  std::promise<void> go;
  ASSERT_TRUE(executor_.Submit("t", [&] { go.get_future().wait(); }).ok());
  ASSERT_TRUE(list_->Add(first_).ok());
  for (int64_t sequence = 1; sequence <= 3; ++sequence) list_->Announce(EstimateOf(sequence));
  list_->Announce(EstimateOf(2));
  EXPECT_THAT(first_->estimates, testing::IsEmpty());
  EXPECT_EQ(executor_.accepted(), 2);
  go.set_value();
  Await();
  ASSERT_EQ(first_->estimates.size(), 1u);
  EXPECT_EQ(first_->estimates.front()->sequence(), 3);
}

TEST_F(ObserverListTest, TellsOfTheLastEstimateBeforeTheEnd) {
  ASSERT_TRUE(list_->Add(first_).ok());
  size_t told = 0;
  list_->Announce(EstimateOf(1));
  list_->AfterAnnounced([&] { told = first_->estimates.size(); });
  Await();
  EXPECT_EQ(told, 1u);
}

TEST_F(ObserverListTest, LetsAnObserverLeaveWhileItIsTold) {
  struct Leaving final : SessionObserver {
    explicit Leaving(ObserverList& watched) : list(watched) {}
    void OnEstimate(const SharedEstimate&) override { list.Remove(this); }
    void OnClosed() override {}
    ObserverList& list;
  };
  ASSERT_TRUE(list_->Add(std::make_shared<Leaving>(*list_)).ok());
  list_->Announce(EstimateOf(1));
  Await();
  EXPECT_EQ(list_->size(), 0u);
}

TEST_F(ObserverListTest, TakesNobodyOnceClosed) {
  ASSERT_TRUE(list_->Add(first_).ok());
  EXPECT_THAT(list_->Close(), testing::ElementsAre(first_));
  EXPECT_EQ(list_->Add(second_), absl::NotFoundError("sessions/a has been deleted"));
  EXPECT_THAT(list_->Close(), testing::IsEmpty());
}

}  // namespace
}  // namespace polyest::internal
