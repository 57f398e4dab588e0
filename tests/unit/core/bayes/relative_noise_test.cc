// Compares a scored sample with the likelihood that it stands for.

#include "core/bayes/relative_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace polyest::internal::relative_noise_test {
namespace {

constexpr double kRelative = 0.3, kOwnError = 0.01;

double Variance(double y) { return kRelative * kRelative * y * y; }

// −log of the likelihood of the sample, up to a constant.
double Exact(double z, double y) {
  const double total = Variance(y) + kOwnError;
  return 0.5 * (z - y) * (z - y) / total + 0.5 * std::log(total);
}

TEST(ScoredSample, HasTheValueAndTheSlopeOfTheLikelihood) {
  const double step = 1e-5;
  for (const double z : {-0.7, 0.4, 2.5}) {
    for (const double y : {-1.3, 0.9}) {
      const double slope = std::copysign(kRelative, y) / std::sqrt(Variance(y));
      const ScoredSample scored = Score(z, y, Variance(y), slope, kOwnError);
      const double variance = scored.noise_variance + kOwnError;
      const double slope_there = (Exact(z, y + step) - Exact(z, y - step)) / (2 * step);
      // The central difference is wrong by its second order, step², times a third derivative below
      // 10³.
      EXPECT_NEAR(-(scored.value - y) / variance, slope_there, 1e3 * step * step);
      const double error = scored.value - y;
      const double total = Variance(y) + kOwnError;
      EXPECT_NEAR(0.5 * error * error / variance + scored.lack, Exact(z, y) - 0.5 * std::log(total),
                  1e-12);
    }
  }
}

TEST(ScoredSample, IsTheSampleItselfWhereTheNoiseIsConstant) {
  const ScoredSample scored = Score(2.5, 2, 0.25, 0, kOwnError);
  EXPECT_DOUBLE_EQ(scored.value, 2.5);
  EXPECT_DOUBLE_EQ(scored.noise_variance, 0.25);
  EXPECT_NEAR(scored.lack, 0, 1e-15);
}

// The likelihood of N samples of a constant a with σ = r a has its maximum at a, where
//   r² a² + a S₁/N = S₂/N, with S₁ = Σ z and S₂ = Σ z².
TEST(ScoredSample, LeadsToTheMaximumOfTheLikelihood) {
  const std::vector<double> z = {0.8, 1.5, 1.1, 0.6, 1.3};
  double first = 0, second = 0;
  for (const double value : z) {
    first += value / static_cast<double>(z.size());
    second += value * value / static_cast<double>(z.size());
  }
  const double r2 = kRelative * kRelative;
  const double exact = (-first + std::sqrt(first * first + 4 * r2 * second)) / (2 * r2);
  double a = 1;
  for (int i = 0; i < 40; ++i) {
    double sum = 0, weights = 0;
    for (const double value : z) {
      const ScoredSample scored = Score(value, a, Variance(a), 1 / a, 0);
      sum += scored.value / scored.noise_variance;
      weights += 1 / scored.noise_variance;
    }
    a = sum / weights;
  }
  EXPECT_NEAR(a, exact, 1e-12);
}

}  // namespace
}  // namespace polyest::internal::relative_noise_test
