// Which component of several the estimate of a piece is of.

#include "core/estimator/posterior/component_of_estimate.h"

#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

TEST(ComponentOfEstimate, HasTheLeastCost) {
  EXPECT_EQ(ComponentOfEstimate({{.cost = 3, .weight = 0.9}}), 0);
  EXPECT_EQ(ComponentOfEstimate({{.cost = 3, .weight = 0.9}, {.cost = 2, .weight = 0.1}}), 1);
}

TEST(ComponentOfEstimate, HasAnExpansionThatFollowsTheModel) {
  EXPECT_EQ(ComponentOfEstimate({{.cost = 2, .shift = 17, .weight = 0.05},
                                 {.cost = 4, .shift = 0.1, .weight = 0.25},
                                 {.cost = 3, .shift = 0.2, .weight = 0.7}}),
            2);
}

TEST(ComponentOfEstimate, HasTheLeastCostWhereTheExpansionsThatFollowAreOfLittle) {
  EXPECT_EQ(ComponentOfEstimate({{.cost = 2, .shift = 17, .weight = 0.6},
                                 {.cost = 3, .shift = 0.2, .weight = 0.4}}),
            0);
  EXPECT_EQ(ComponentOfEstimate({{.cost = 3, .shift = 2}, {.cost = 2, .shift = 1}}), 1);
}

// Those at least as accurate as 0.3 have 0.55 of the weight; that of the least cost has 0.05.
TEST(ComponentOfEstimate, IsAmongTheMoreAccurateHalfWhereNoneIsAccurate) {
  EXPECT_EQ(ComponentOfEstimate({{.cost = 1, .shift = 8, .weight = 0.05},
                                 {.cost = 2, .shift = 0.6, .weight = 0.4},
                                 {.cost = 3, .shift = 0.3, .weight = 0.2},
                                 {.cost = 4, .shift = 0.1, .weight = 0.35}}),
            2);
}

}  // namespace
}  // namespace polyest::internal
