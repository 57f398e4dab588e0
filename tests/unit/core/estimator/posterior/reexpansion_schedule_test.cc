// When a component looks at its expansion: rows by hand.

#include "core/estimator/posterior/reexpansion_schedule.h"

#include <gtest/gtest.h>

#include <limits>

namespace polyest::internal {
namespace {

constexpr int64_t kNever = std::numeric_limits<int64_t>::max();

TEST(ReexpansionSchedule, EndsWindowsAfterThreeTenthsOfTheRecordSinceTheirBeginning) {
  ReexpansionSchedule schedule;
  EXPECT_FALSE(schedule.WindowEnds(1));
  EXPECT_TRUE(schedule.WindowEnds(2));
  schedule.EndWindow(100, kNever);
  EXPECT_FALSE(schedule.WindowEnds(129));
  EXPECT_TRUE(schedule.WindowEnds(130));
  schedule.EndWindow(100, 110);
  EXPECT_TRUE(schedule.WindowEnds(110));
  schedule.CountAnewFrom(100);
  EXPECT_TRUE(schedule.WindowEnds(102));
  schedule.EndWindow(200, kNever);
  EXPECT_TRUE(schedule.WindowEnds(230));  // 100 + 1.3 · 100
}

TEST(ReexpansionSchedule, LooksAtEdgesTwentyTimesInTheRecord) {
  ReexpansionSchedule schedule;
  schedule.PutOffEdges(100);
  EXPECT_FALSE(schedule.LooksAtEdges(105));
  EXPECT_TRUE(schedule.LooksAtEdges(106));
}

TEST(ReexpansionSchedule, LetsFourAttemptsBeMadeAtARow) {
  ReexpansionSchedule schedule;
  for (int i = 0; i < 4; ++i) {
    EXPECT_TRUE(schedule.MayReexpandBefore(7));
    schedule.CountAttempt();
  }
  EXPECT_FALSE(schedule.MayReexpandBefore(7));
  EXPECT_TRUE(schedule.MayReexpandBefore(8));
}

TEST(ReexpansionSchedule, TakesAnEighthOfTheRecordAfterAnAttemptInVain) {
  ReexpansionSchedule schedule;
  schedule.TolerateResiduals(80);
  EXPECT_TRUE(schedule.ToleratesResiduals(90));
  EXPECT_FALSE(schedule.ToleratesResiduals(91));
}

TEST(ReexpansionSchedule, GivesAPartItsWindowsAndNothingElse) {
  ReexpansionSchedule whole;
  whole.CountAnewFrom(50);
  whole.StayWhole(100);
  whole.TolerateResiduals(100);
  const ReexpansionSchedule part = whole.OfPart(100);
  EXPECT_TRUE(part.WindowEnds(100));
  EXPECT_FALSE(part.ToleratesResiduals(100));
  EXPECT_FALSE(part.StaysWhole(100));
  EXPECT_EQ(part.state().windows_from, 50);
}

}  // namespace
}  // namespace polyest::internal
