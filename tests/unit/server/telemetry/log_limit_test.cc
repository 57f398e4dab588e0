#include "server/telemetry/log_limit.h"

#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

TEST(LogLimit, AllowsABurstAndThenSoManyASecondAndSaysHowManyWereLeftOut) {
  LogLimit limit(3, 2);
  auto now = LogLimit::Clock::time_point();
  for (int i = 0; i < 3; ++i) EXPECT_EQ(limit.Admit("a", now), 0);
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(limit.Admit("a", now));
  now += std::chrono::milliseconds(500);
  EXPECT_EQ(limit.Admit("a", now), 5);
  EXPECT_FALSE(limit.Admit("a", now));
  now += std::chrono::hours(1);
  EXPECT_EQ(limit.Admit("a", now), 1);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(limit.Admit("a", now), 0);
  EXPECT_FALSE(limit.Admit("a", now));
}

TEST(LogLimit, LimitsEachKindAlone) {
  LogLimit limit(1, 1);
  const auto now = LogLimit::Clock::time_point();
  EXPECT_TRUE(limit.Admit("a", now));
  EXPECT_FALSE(limit.Admit("a", now));
  EXPECT_TRUE(limit.Admit("b", now));
}

}  // namespace
}  // namespace polyest::internal
