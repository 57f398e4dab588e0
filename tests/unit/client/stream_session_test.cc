#include "client/cli/stream_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <utility>

#include "client/cli/first_rows.h"

namespace polyest::internal::stream_session_test {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

v1::Measurements Rows() {
  v1::Measurements batch;
  for (const double time : {1, 2, 3, 4}) batch.add_time_s(time);
  auto& channel = *batch.add_channels();
  channel.set_name("x");
  for (const double value : {10, 20, 0, 40}) channel.add_values(value);
  channel.add_missing(0);
  channel.add_missing(2);
  return batch;
}

TEST(RemoveRowsUpTo, KeepsWhatIsLater) {
  v1::Measurements batch = Rows();
  EXPECT_EQ(RemoveRowsUpTo({0, 2}, batch), 2);
  EXPECT_THAT(batch.time_s(), ElementsAre(3, 4));
  EXPECT_THAT(batch.channels(0).values(), ElementsAre(0, 40));
  EXPECT_THAT(batch.channels(0).missing(), ElementsAre(0));
}

TEST(RemoveRowsUpTo, MayTakeAllOrNone) {
  v1::Measurements batch = Rows();
  EXPECT_EQ(RemoveRowsUpTo({0, 0.5}, batch), 0);
  EXPECT_EQ(batch.time_s_size(), 4);
  EXPECT_EQ(RemoveRowsUpTo({0, 10}, batch), 4);
  EXPECT_THAT(batch.time_s(), IsEmpty());
}

TEST(RemoveRowsUpTo, LeavesLaterRunsAlone) {
  v1::Measurements batch = Rows();
  for (const int run : {0, 0, 1, 1}) batch.add_run(run);
  EXPECT_EQ(RemoveRowsUpTo({0, 10}, batch), 2);
  EXPECT_THAT(batch.run(), ElementsAre(1, 1));
}

TEST(RemoveRowsUpTo, TakesEarlierRunsWhole) {
  v1::Measurements batch = Rows();
  for (const int run : {0, 0, 1, 1}) batch.add_run(run);
  EXPECT_EQ(RemoveRowsUpTo({1, 3}, batch), 3);
  EXPECT_THAT(batch.time_s(), ElementsAre(4));
}

TEST(FirstRows, AreThoseThatAreEarlier) {
  v1::Measurements batch = Rows();
  for (const int run : {0, 0, 1, 1}) batch.add_run(run);
  batch = FirstRows(std::move(batch), 2);
  EXPECT_THAT(batch.time_s(), ElementsAre(1, 2));
  EXPECT_THAT(batch.run(), ElementsAre(0, 0));
  EXPECT_THAT(batch.channels(0).values(), ElementsAre(10, 20));
  EXPECT_THAT(batch.channels(0).missing(), ElementsAre(0));
}

}  // namespace
}  // namespace polyest::internal::stream_session_test
