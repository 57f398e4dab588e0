// Widening of a posterior's draws: by the factor asked for, never beyond the prior.

#include <gtest/gtest.h>

#include <cmath>

#include "core/bayes/weighted_samples.h"
#include "core/estimator/posterior/posterior_draws.h"

namespace polyest::internal {
namespace {

constexpr Eigen::Index kCount = 400;

// Returns draws of one parameter, equally spaced, with this mean and standard deviation.
PosteriorDraws Spaced(double mean, double deviation) {
  PosteriorDraws draws;
  Vector scores = Vector::LinSpaced(kCount, -1, 1);
  scores /= std::sqrt(scores.squaredNorm() / kCount);
  draws.scores = mean + deviation * scores.array();
  draws.weights = Vector::Constant(kCount, 1.0 / kCount);
  return draws;
}

double Deviation(const PosteriorDraws& draws) {
  const double mean = WeightedMean(draws.scores.col(0), draws.weights);
  return std::sqrt((draws.scores.col(0).array() - mean).square().mean());
}

PosteriorDraws Widened(PosteriorDraws draws, double factor, const UncertainParameter& parameter) {
  Widen(Vector::Constant(1, factor), Prior({parameter}), draws);
  return draws;
}

TEST(WidenedDraws, HaveTheFactorAskedFor) {
  const PosteriorDraws draws =
      Widened(Spaced(0.3, 0.05), 4, *UncertainParameter::Normal("k", 40, 2));
  EXPECT_NEAR(Deviation(draws), 0.2, 1e-12);
  EXPECT_NEAR(WeightedMean(draws.scores.col(0), draws.weights), 0.3, 1e-12);
}

// A lognormal parameter 106 times as wide would reach from 0 to infinity.
TEST(WidenedDraws, AreNoWiderThanThePrior) {
  const UncertainParameter parameter = *UncertainParameter::Lognormal("f", 2, 0.5);
  const PosteriorDraws draws = Widened(Spaced(0.3, 0.9), 106, parameter);
  EXPECT_NEAR(Deviation(draws), 1, 1e-12);  // the score's under the prior
  const Vector parameters = draws.Parameter(Prior({parameter}), 0);
  EXPECT_LT(parameters.maxCoeff(), 2 * std::exp(0.25 * (0.3 + std::sqrt(3.0))));
}

TEST(WidenedDraws, StayAsTheyAreWhenWiderThanThePrior) {
  const PosteriorDraws draws = Widened(Spaced(0, 1.2), 3, *UncertainParameter::Normal("k", 40, 2));
  EXPECT_NEAR(Deviation(draws), 1.2, 1e-12);
}

TEST(WidenedDraws, StayWithinBounds) {
  const PosteriorDraws draws =
      Widened(Spaced(0.8, 0.1), 5, *UncertainParameter::Uniform("k", 10, 20));
  EXPECT_EQ(draws.scores.maxCoeff(), 1);
  EXPECT_GE(draws.scores.minCoeff(), -1);
}

}  // namespace
}  // namespace polyest::internal
