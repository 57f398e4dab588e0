#include "server/service/estimate_schedule.h"

#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

using Policy = EstimateSchedule::Policy;
using std::chrono::milliseconds;

// Any moment; the schedule looks at differences only.
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
  policy.mutable_min_interval()->set_nanos(100'000'000);
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
  policy.mutable_min_interval()->set_seconds(-1);
  EXPECT_EQ(schedule.Set(policy).code(), absl::StatusCode::kInvalidArgument);
  policy.mutable_min_interval()->set_seconds(INT64_MAX);
  EXPECT_EQ(schedule.Set(policy).code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(schedule.Due(kStart));
}

}  // namespace
}  // namespace polyest::internal
