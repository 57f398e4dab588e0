#include "core/bayes/l_curve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/unit/core/bayes/frequency_example.h"

namespace polyest::internal::l_curve_test {
namespace {

// Returns the minimum for α² of linear data z_i = s_i ξ_i with unit noise and unit normal priors:
// ξ_i = s_i z_i/(s_i² + α²). `residual` is the χ² that no ξ removes.
MinimumAt LinearProblem(Eigen::Vector2d s, Eigen::Vector2d z, double residual) {
  return [=](double regularization) -> std::optional<RegularizedMinimum> {
    CostValue cost;
    cost.mismatch = residual / 2;
    cost.prior = std::log(2 * M_PI);
    for (int i = 0; i < 2; ++i) {
      const double xi = s[i] * z[i] / (s[i] * s[i] + regularization);
      cost.mismatch += std::pow(z[i] - s[i] * xi, 2) / 2;
      cost.prior += xi * xi / 2;
    }
    cost.total = cost.mismatch + regularization * cost.prior;
    RegularizedMinimum minimum;
    minimum.regularization = regularization;
    minimum.cost = cost;
    return minimum;
  };
}

std::vector<RegularizedMinimum> Sweep(const MinimumAt& minimum) {
  return SweepRegularization(RangeOfChoice(), minimum);
}

Prior TwoNormals() {
  return Prior({UncertainParameter::Normal("a", 0, 1).value(),
                UncertainParameter::Normal("b", 0, 1).value()});
}

TEST(LCurve, FindsTheCornerOfAnIllPosedProblem) {
  // The unknown ξ_2 = 0.01/(10⁻⁴ + α²) runs away below α² = 0.02. The unknown ξ_1 = 0.5 costs
  // mismatch above α² = 200.
  const RegularizationChoice choice =
      ChooseByLCurve(Sweep(LinearProblem({100, 0.01}, {50, 1}, 4)), TwoNormals());
  EXPECT_TRUE(choice.determined);
  EXPECT_EQ(choice.reason, "");
  EXPECT_GT(choice.regularization, 0.01);
  EXPECT_LT(choice.regularization, 400);
}

TEST(LCurve, IsLookedForFourDecadesOnEitherSideOfOne) {
  const auto points = Sweep(LinearProblem({100, 0.01}, {50, 1}, 4));
  ASSERT_EQ(points.size(), 33u);
  EXPECT_DOUBLE_EQ(points.front().regularization, 1e-4);
  EXPECT_EQ(points[16].regularization, 1);
  EXPECT_DOUBLE_EQ(points.back().regularization, 1e4);
  for (size_t i = 1; i < points.size(); ++i) {
    EXPECT_GE(points[i].cost.mismatch, points[i - 1].cost.mismatch);
    EXPECT_LE(points[i].cost.prior, points[i - 1].cost.prior);
  }
}

TEST(LCurve, HasNoCornerWhereTheDataDetermineEverything) {
  const RegularizationChoice choice =
      ChooseByLCurve(Sweep(LinearProblem({100, 80}, {50, -40}, 30)), TwoNormals());
  EXPECT_FALSE(choice.determined);
  EXPECT_EQ(choice.regularization, 1);
  EXPECT_NE(choice.reason, "");
}

TEST(LCurve, OfTheFrequencyExampleHasNoCornerBecauseItsDatumIsMetExactly) {
  const auto points = Sweep([](double regularization) {
    const Cost cost = FrequencyCost(0.0628, regularization);
    return DescribeMinimum(cost, FrequencyMinimum(cost).point);
  });
  const RegularizationChoice choice = ChooseByLCurve(points, FrequencyCost(1, 1).prior());
  EXPECT_FALSE(choice.determined);
  EXPECT_EQ(choice.regularization, 1);
  EXPECT_LT(points.front().cost.mismatch, 1e-8);
  EXPECT_GT(points.back().cost.mismatch, 1);
}

TEST(LCurve, SurvivesDegenerateCosts) {
  for (const double mismatch : {0.0, 1.0, std::numeric_limits<double>::quiet_NaN()}) {
    const auto points = Sweep([=](double regularization) {
      RegularizedMinimum minimum;
      minimum.regularization = regularization;
      minimum.cost = {mismatch, std::numeric_limits<double>::infinity(), mismatch};
      return std::optional(minimum);
    });
    const RegularizationChoice choice = ChooseByLCurve(points, TwoNormals());
    EXPECT_FALSE(choice.determined);
    EXPECT_EQ(choice.regularization, 1);
  }
  EXPECT_FALSE(ChooseByLCurve({}, TwoNormals()).determined);
}

}  // namespace
}  // namespace polyest::internal::l_curve_test
