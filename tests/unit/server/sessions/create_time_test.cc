#include "server/sessions/create_time.h"

#include <gtest/gtest.h>

namespace polyest::internal::create_time_test {
namespace {

constexpr int64_t kYear1 = -62'135'596'800, kEndOfYear9999 = 253'402'300'799;

google::protobuf::Timestamp Time(int64_t seconds, int32_t nanos) {
  google::protobuf::Timestamp time;
  time.set_seconds(seconds);
  time.set_nanos(nanos);
  return time;
}

// Expects that JSON does not allow a time, and that `nearest` is the nearest that it does.
void ExpectNearest(const google::protobuf::Timestamp& time,
                   const google::protobuf::Timestamp& nearest) {
  EXPECT_FALSE(HasJsonForm(time));
  EXPECT_TRUE(HasJsonForm(nearest));
  EXPECT_EQ(NearestWithJsonForm(time).seconds(), nearest.seconds());
  EXPECT_EQ(NearestWithJsonForm(time).nanos(), nearest.nanos());
}

TEST(CreateTime, IsMovedToTheNearestThatJsonAllows) {
  ExpectNearest(Time(kEndOfYear9999 + 1, 5), Time(kEndOfYear9999, 999'999'999));
  ExpectNearest(Time(kYear1 - 1, 5), Time(kYear1, 0));
  ExpectNearest(Time(7, 1'000'000'000), Time(7, 999'999'999));
  ExpectNearest(Time(7, -1), Time(7, 0));
}

TEST(CreateTime, StaysAsItIsIfJsonAllowsIt) {
  EXPECT_TRUE(HasJsonForm(Time(-7, 8)));
  EXPECT_EQ(NearestWithJsonForm(Time(-7, 8)).seconds(), -7);
  EXPECT_EQ(NearestWithJsonForm(Time(-7, 8)).nanos(), 8);
}

}  // namespace
}  // namespace polyest::internal::create_time_test
