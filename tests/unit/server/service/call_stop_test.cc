#include "server/service/call_stop.h"

#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

gpr_timespec Seconds(int64_t seconds) { return {seconds, 500'000'000, GPR_TIMESPAN}; }

TEST(CallStop, CountsTheTimeThatRemains) {
  EXPECT_EQ(CallStop::Duration(Seconds(0)), std::chrono::milliseconds(500));
  EXPECT_EQ(CallStop::Duration(Seconds(86'400)),
            std::chrono::hours(24) + std::chrono::milliseconds(500));
  // The deadline has passed.
  EXPECT_EQ(CallStop::Duration(Seconds(-2)), std::chrono::milliseconds(-1'500));
}

TEST(CallStop, HasNoDeadlineWhereThatIsFartherThanItsClockGoes) {
  // The duration is the longest that a call can ask for, in hours.
  EXPECT_EQ(CallStop::Duration(Seconds(int64_t{99'999'999} * 3'600)), std::nullopt);
  EXPECT_EQ(CallStop::Duration(gpr_inf_future(GPR_TIMESPAN)), std::nullopt);
}

}  // namespace
}  // namespace polyest::internal
