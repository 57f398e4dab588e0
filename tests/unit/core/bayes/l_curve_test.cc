#include "core/bayes/l_curve.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/unit/core/bayes/frequency_example.h"

namespace polyest {
namespace {

// Linear data z_i = s_i ξ_i with unit noise, unit normal priors and a residual χ² that no ξ
// removes: the minimum for α² is ξ_i = s_i z_i/(s_i² + α²).
std::function<CostValue(double)> LinearProblem(Eigen::Vector2d s, Eigen::Vector2d z,
                                               double residual) {
  return [=](double regularization) {
    CostValue cost;
    cost.mismatch = residual / 2;
    cost.prior = std::log(2 * M_PI);
    for (int i = 0; i < 2; ++i) {
      const double xi = s[i] * z[i] / (s[i] * s[i] + regularization);
      cost.mismatch += std::pow(z[i] - s[i] * xi, 2) / 2;
      cost.prior += xi * xi / 2;
    }
    cost.total = cost.mismatch + regularization * cost.prior;
    return cost;
  };
}

Prior TwoNormals() {
  return Prior({UncertainParameter::Normal("a", 0, 1).value(),
                UncertainParameter::Normal("b", 0, 1).value()});
}

TEST(LCurve, FindsTheCornerOfAnIllPosedProblem) {
  // ξ_2 = 0.01/(10⁻⁴ + α²) runs away below α² = 0.02; ξ_1 = 0.5 costs mismatch above α² = 200.
  const LCurve curve = ChooseByLCurve(LinearProblem({100, 0.01}, {50, 1}, 4), TwoNormals());
  EXPECT_TRUE(curve.corner_found);
  EXPECT_GT(curve.regularization, 0.01);
  EXPECT_LT(curve.regularization, 400);
}

TEST(LCurve, SweepsFourDecadesOnEitherSideOfOne) {
  const LCurve curve = ChooseByLCurve(LinearProblem({100, 0.01}, {50, 1}, 4), TwoNormals());
  ASSERT_EQ(curve.points.size(), 33u);
  EXPECT_DOUBLE_EQ(curve.points.front().regularization, 1e-4);
  EXPECT_EQ(curve.points[16].regularization, 1);
  EXPECT_DOUBLE_EQ(curve.points.back().regularization, 1e4);
  for (size_t i = 1; i < curve.points.size(); ++i) {
    EXPECT_GE(curve.points[i].cost.mismatch, curve.points[i - 1].cost.mismatch);
    EXPECT_LE(curve.points[i].cost.prior, curve.points[i - 1].cost.prior);
  }
}

TEST(LCurve, HasNoCornerWhereTheDataDetermineEverything) {
  const LCurve curve = ChooseByLCurve(LinearProblem({100, 80}, {50, -40}, 30), TwoNormals());
  EXPECT_FALSE(curve.corner_found);
  EXPECT_EQ(curve.regularization, 1);
}

TEST(LCurve, OfTheFrequencyExampleHasNoCornerBecauseItsDatumIsMetExactly) {
  const auto minimum = [](double regularization) {
    const Cost cost = FrequencyCost(0.0628, regularization);
    return cost.Evaluate(FrequencyMinimum(cost).point);
  };
  const LCurve curve = ChooseByLCurve(minimum, FrequencyCost(1, 1).prior());
  EXPECT_FALSE(curve.corner_found);
  EXPECT_EQ(curve.regularization, 1);
  EXPECT_LT(curve.points.front().cost.mismatch, 1e-8);
  EXPECT_GT(curve.points.back().cost.mismatch, 1);
}

TEST(LCurve, SurvivesDegenerateCosts) {
  for (const double mismatch : {0.0, 1.0, std::numeric_limits<double>::quiet_NaN()}) {
    const LCurve curve = ChooseByLCurve(
        [=](double) {
          return CostValue{mismatch, std::numeric_limits<double>::infinity(), mismatch};
        },
        TwoNormals());
    EXPECT_FALSE(curve.corner_found);
    EXPECT_EQ(curve.regularization, 1);
  }
}

}  // namespace
}  // namespace polyest
