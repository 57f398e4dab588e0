// Tests which order OrderChoice takes, for methods whose steps cost what a test says.

#include "core/propagation/order_choice.h"

#include <gtest/gtest.h>

namespace polyest::internal {
namespace {

struct Cost {
  int evaluations;  // of a step
  double step_s;
  bool is_whole = false;
};

// Takes steps and returns the share of them that is of high order.
double HighShare(OrderChoice& choice, int steps, const Cost& low, const Cost& high) {
  int taken = 0;
  for (int k = 0; k < steps; ++k) {
    const Cost& cost = choice.high() ? high : low;
    taken += choice.high() ? 1 : 0;
    choice.CountEvaluations(cost.evaluations);
    choice.Accept(cost.step_s, cost.is_whole);
  }
  return static_cast<double>(taken) / steps;
}

TEST(OrderChoice, TakesHighOrderWhereItsStepsAreLong) {
  OrderChoice choice;
  EXPECT_FALSE(choice.high());
  // Beside the first window there are trials of low order: 16 steps in at least 16 windows of 12.
  EXPECT_GT(HighShare(choice, 10'000, {6, 1}, {12, 3}), 1 - 16.0 / (16 * 12));
  EXPECT_TRUE(choice.high());
}

TEST(OrderChoice, KeepsLowOrderWhereStepsOfHighOrderAreHardlyLonger) {
  OrderChoice choice;
  // The pauses between trials double up to 1,024 windows.
  EXPECT_LT(HighShare(choice, 100'000, {6, 1}, {12, 1.5}), 0.005);
}

TEST(OrderChoice, CountsStepsThatWereRejected) {
  OrderChoice choice;
  EXPECT_LT(HighShare(choice, 100'000, {6, 1}, {36, 3}), 0.005);
}

TEST(OrderChoice, TriesNothingWhereEveryStepLeadsToTheNextStop) {
  OrderChoice choice;
  EXPECT_EQ(HighShare(choice, 10'000, {6, 1, true}, {12, 3}), 0);
}

TEST(OrderChoice, ComesBackWhenHighOrderNoLongerPays) {
  OrderChoice choice;
  HighShare(choice, 1'000, {6, 1}, {12, 3});
  ASSERT_TRUE(choice.high());
  HighShare(choice, 1'000, {6, 1}, {12, 1.5});
  EXPECT_FALSE(choice.high());
}

}  // namespace
}  // namespace polyest::internal
