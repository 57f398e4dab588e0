// Tests which draws of a posterior are returned as its samples.

#include "core/estimator/studies/sample_choice.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(SampleChoice, TakesADrawAsOftenAsItsWeightAsksFor) {
  const SampleChoice choice = ChooseSamples(Vector{{1, 0, 2, 1}}, Eigen::VectorXi(), 4);
  EXPECT_THAT(choice.draws, ElementsAre(0, 2, 2, 3));
  EXPECT_THAT(choice.groups, IsEmpty());
}

TEST(SampleChoice, TakesEquallyManyOfEachGroup) {
  const Eigen::VectorXi groups{{0, 1, 0, 1}};
  const SampleChoice choice = ChooseSamples(Vector{{1, 3, 1, 1}}, groups, 5);
  EXPECT_THAT(choice.draws, ElementsAre(0, 0, 2, 1, 1));
  EXPECT_THAT(choice.groups, ElementsAre(0, 0, 0, 1, 1));
}

// Half of the weight is a group's share here; a quarter is too little, and just enough is not.
TEST(SampleChoice, ForgetsGroupsWhereOneHasLessThanHalfOfItsShare) {
  const Eigen::VectorXi groups{{0, 1}};
  const SampleChoice enough = ChooseSamples(Vector{{1, 3}}, groups, 4);
  EXPECT_THAT(enough.draws, ElementsAre(0, 0, 1, 1));
  EXPECT_THAT(enough.groups, ElementsAre(0, 0, 1, 1));
  const SampleChoice light = ChooseSamples(Vector{{1, 7}}, groups, 8);
  EXPECT_THAT(light.draws, ElementsAre(0, 1, 1, 1, 1, 1, 1, 1));
  EXPECT_THAT(light.groups, IsEmpty());
}

TEST(SampleChoice, MayBeOfNoSamples) {
  const SampleChoice none = ChooseSamples(Vector{{1, 1}}, Eigen::VectorXi{{0, 1}}, 0);
  EXPECT_THAT(none.draws, IsEmpty());
  EXPECT_THAT(none.groups, IsEmpty());
}

}  // namespace
}  // namespace polyest::internal
