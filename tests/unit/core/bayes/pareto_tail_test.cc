// The shape of the tail of importance weights. The oracle is the distribution that the weights are
// quantiles of.

#include "core/bayes/pareto_tail.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace polyest::internal {
namespace {

// Returns evenly spaced quantiles of the generalized Pareto distribution, ((1 − p)^−k − 1)/k.
Vector ParetoQuantiles(double k, Eigen::Index count) {
  Vector quantiles(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const double p = (static_cast<double>(i) + 0.5) / static_cast<double>(count);
    quantiles[i] = k == 0 ? -std::log1p(-p) : std::expm1(-k * std::log1p(-p)) / k;
  }
  return quantiles;
}

TEST(ParetoShape, IsThatOfTheDistribution) {
  constexpr Eigen::Index kCount = 2000;
  for (const double k : {-0.5, 0.0, 0.3, 0.7, 1.2}) {
    // The standard deviation of a maximum likelihood estimate is (1 + k)/√N; quantiles have less
    // scatter than draws. The prior's ten excesses move it by 10 (½ − k)/N.
    EXPECT_NEAR(*ParetoShape(ParetoQuantiles(k, kCount)), k, (1 + std::abs(k)) / std::sqrt(kCount));
  }
}

TEST(ParetoShape, DoesNotDependOnScaleOrOrder) {
  const Vector excesses = ParetoQuantiles(0.4, 50);
  const double shape = *ParetoShape(excesses);
  EXPECT_NEAR(*ParetoShape(1e-9 * excesses), shape, 1e-9);
  EXPECT_EQ(*ParetoShape(excesses.reverse()), shape);
}

TEST(ParetoShape, IsDrawnTowardsAHalfByTenExcesses) {
  // Of ten excesses half the weight is the prior's: k = −½ looks like about 0.
  EXPECT_NEAR(*ParetoShape(ParetoQuantiles(-0.5, 10)), 0, 0.2);
}

TEST(ParetoShape, IsNoneWithoutATail) {
  EXPECT_EQ(ParetoShape(Vector::Ones(4)), std::nullopt);
  EXPECT_EQ(ParetoShape(Vector::Ones(100)), std::nullopt);
  EXPECT_EQ(ParetoShape(Vector::Zero(100)), std::nullopt);
}

TEST(TailShape, IsThatOfTheLargestWeights) {
  // Weights 1/(1 − p)^k have a Pareto tail above any threshold.
  constexpr Eigen::Index kCount = 4000;
  for (const double k : {0.2, 0.6, 0.9}) {
    Vector logs(kCount);
    for (Eigen::Index i = 0; i < kCount; ++i) logs[i] = -k * std::log((i + 0.5) / kCount);
    // The tail has 3 √4000 ≈ 190 weights.
    EXPECT_NEAR(*TailShape(logs), k, (1 + k) / std::sqrt(190));
    EXPECT_NEAR(*TailShape(logs.array() + 700), *TailShape(logs), 1e-9);
  }
}

TEST(TailShape, NeedsTwentyFiveDraws) {
  const Vector logs = Vector::LinSpaced(25, 0, 3);
  EXPECT_TRUE(TailShape(logs));
  EXPECT_FALSE(TailShape(logs.head(24)));
}

TEST(TailShape, IsNoneForWeightsThatAreNotFinite) {
  Vector logs = Vector::LinSpaced(30, 0, 3);
  logs[3] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(TailShape(logs), std::nullopt);
}

}  // namespace
}  // namespace polyest::internal
