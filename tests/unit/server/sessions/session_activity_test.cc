#include "server/sessions/session_activity.h"

#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

using std::chrono::seconds;

TEST(SessionActivity, SaysHowFarTheEstimatorIsWhileItIsInMemory) {
  SessionActivity activity;
  EXPECT_EQ(activity.Summarize().sequence, std::nullopt);
  activity.OnLoaded(3, 100);
  EXPECT_EQ(activity.Summarize().sequence, 3);
  activity.OnComputed(seconds(1), 5, 102);
  EXPECT_EQ(activity.Summarize().sequence, 5);
  activity.OnUnloaded();
  EXPECT_EQ(activity.Summarize().sequence, std::nullopt);
}

TEST(SessionActivity, ComparesMeasuredWithComputedSecondsSinceItIsInMemory) {
  SessionActivity activity;
  activity.OnLoaded(3, 100);
  EXPECT_EQ(activity.Summarize().real_time_factor, 0);
  activity.OnComputed(seconds(1), 4, 110);
  activity.OnComputed(seconds(3), 5, 120);
  EXPECT_EQ(activity.Summarize().real_time_factor, 20.0 / 4);
  activity.OnUnloaded();
  activity.OnLoaded(5, 120);
  EXPECT_EQ(activity.Summarize().real_time_factor, 0);
  // The time computed before unloading still counts in the total.
  EXPECT_EQ(activity.Summarize().compute_s, 4);
}

TEST(SessionActivity, CountsEstimatesAndTellsNewReexpansions) {
  SessionActivity activity;
  EXPECT_EQ(activity.OnEstimate(2), 2);
  EXPECT_EQ(activity.OnEstimate(5), 3);
  // A new estimator begins to count anew.
  EXPECT_EQ(activity.OnEstimate(1), 0);
  EXPECT_EQ(activity.Summarize().estimates, 3);
  EXPECT_EQ(activity.Summarize().reexpansions, 1);
}

TEST(SessionActivity, IsIdleSinceItWasLastUsed) {
  SessionActivity activity;
  const auto begin = SessionActivity::Clock::now();
  activity.OnUsed();
  const auto idle = activity.idle();
  EXPECT_LE(idle, SessionActivity::Clock::now() - begin);
}

}  // namespace
}  // namespace polyest::internal
