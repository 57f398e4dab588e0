#include "server/sessions/observer_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/server/sessions/counting_observer.h"

namespace polyest::internal {
namespace {

class ObserverListTest : public testing::Test {
 protected:
  ObserverList list_{"sessions/a"};
  const std::shared_ptr<CountingObserver> first_ = std::make_shared<CountingObserver>();
  const std::shared_ptr<CountingObserver> second_ = std::make_shared<CountingObserver>();
  const SharedEstimate estimate_ = std::make_shared<v1::Estimate>();
};

TEST_F(ObserverListTest, GivesAnEstimateToAllWhoWatch) {
  ASSERT_TRUE(list_.Add(first_).ok());
  ASSERT_TRUE(list_.Add(second_).ok());
  list_.OnEstimate(estimate_);
  list_.Remove(first_.get());
  list_.OnEstimate(estimate_);
  EXPECT_THAT(first_->estimates, testing::ElementsAre(estimate_));
  EXPECT_THAT(second_->estimates, testing::ElementsAre(estimate_, estimate_));
  EXPECT_EQ(list_.size(), 1u);
}

TEST_F(ObserverListTest, LetsAnObserverLeaveWhileItIsTold) {
  struct Leaving final : SessionObserver {
    explicit Leaving(ObserverList& watched) : list(watched) {}
    void OnEstimate(const SharedEstimate&) override { list.Remove(this); }
    void OnClosed() override {}
    ObserverList& list;
  };
  ASSERT_TRUE(list_.Add(std::make_shared<Leaving>(list_)).ok());
  list_.OnEstimate(estimate_);
  EXPECT_EQ(list_.size(), 0u);
}

TEST_F(ObserverListTest, TakesNobodyOnceClosed) {
  ASSERT_TRUE(list_.Add(first_).ok());
  EXPECT_THAT(list_.Close(), testing::ElementsAre(first_));
  EXPECT_EQ(list_.Add(second_), absl::NotFoundError("sessions/a has been deleted"));
  EXPECT_THAT(list_.Close(), testing::IsEmpty());
}

}  // namespace
}  // namespace polyest::internal
