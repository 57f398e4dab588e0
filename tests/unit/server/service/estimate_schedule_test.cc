#include "server/service/estimate_schedule.h"

#include <gtest/gtest.h>

#include <cmath>

namespace polyest::internal {
namespace {

using Policy = EstimateSchedule::Policy;
using std::chrono::milliseconds;

// The start may be any moment; the schedule looks at differences only.
constexpr EstimateSchedule::Clock::time_point kStart{std::chrono::hours(1)};

TEST(EstimateSchedule, IsDueAfterEveryBatchUnlessAskedOtherwise) {
  EstimateSchedule schedule;
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(schedule.Due(kStart));
}

TEST(EstimateSchedule, CountsBatches) {
  EstimateSchedule schedule;
  Policy policy;
  policy.set_batch_count(3);
  ASSERT_TRUE(schedule.Set(policy).ok());
  for (const bool due : {false, false, true, false, false, true}) {
    EXPECT_EQ(schedule.Due(kStart), due);
  }
}

TEST(EstimateSchedule, WaitsForTheIntervalAndThenForTheNextBatch) {
  EstimateSchedule schedule;
  Policy policy;
  policy.set_min_interval_s(0.1);
  ASSERT_TRUE(schedule.Set(policy).ok());
  EXPECT_TRUE(schedule.Due(kStart));
  EXPECT_FALSE(schedule.Due(kStart + milliseconds(99)));
  EXPECT_TRUE(schedule.Due(kStart + milliseconds(100)));
  EXPECT_FALSE(schedule.Due(kStart + milliseconds(199)));
}

TEST(EstimateSchedule, IsNeverDueWhenOnlyTheLastIsWanted) {
  EstimateSchedule schedule;
  Policy policy;
  policy.set_only_last(true);
  policy.set_batch_count(1);
  ASSERT_TRUE(schedule.Set(policy).ok());
  for (int i = 0; i < 3; ++i) EXPECT_FALSE(schedule.Due(kStart));
}

TEST(EstimateSchedule, RefusesNegativeNumbersAndKeepsWhatItHad) {
  EstimateSchedule schedule;
  Policy policy;
  policy.set_batch_count(-2);
  EXPECT_EQ(schedule.Set(policy).message(), "estimates.batchCount: -2 must not be negative");
  policy.set_batch_count(5);
  for (const double interval_s : {-1.0, 86'401.0, std::nan(""), HUGE_VAL}) {
    policy.set_min_interval_s(interval_s);
    EXPECT_EQ(schedule.Set(policy).code(), absl::StatusCode::kInvalidArgument) << interval_s;
  }
  EXPECT_TRUE(schedule.Due(kStart));
}

}  // namespace
}  // namespace polyest::internal
