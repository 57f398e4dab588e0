// The scatter of residuals against what is known of independent and of correlated ones.

#include "core/estimator/studies/residual_scatter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace polyest::internal::residual_scatter_test {
namespace {

constexpr int kRows = 20'000;

// Returns residuals of one channel with the correlation a between successive ones.
Vector Residuals(double a, uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  Vector u(kRows);
  u[0] = normal(generator);
  for (int k = 1; k < kRows; ++k) u[k] = a * u[k - 1] + std::sqrt(1 - a * a) * normal(generator);
  return u;
}

double DispersionOf(const Vector& residuals) {
  ResidualScatter scatter(1);
  scatter.Add(residuals, true);
  return scatter.Dispersion();
}

// Independent residuals: χ²/N has the standard deviation √(2/N), the blocks' variance √(2·16/N).
TEST(ResidualScatter, OfIndependentResidualsIsOne) {
  EXPECT_GE(DispersionOf(Residuals(0, 1)), 1);
  EXPECT_LE(DispersionOf(Residuals(0, 1)), 1 + 4 * std::sqrt(32.0 / kRows));
}

// The variance of long sums grows by (1 + a)/(1 − a), that of squares by the factor itself.
TEST(ResidualScatter, GrowsWithCorrelationAndSize) {
  const double correlated = (1 + 0.5) / (1 - 0.5);
  EXPECT_NEAR(DispersionOf(Residuals(0.5, 2)), correlated, 0.1 * correlated);
  EXPECT_NEAR(DispersionOf(3 * Residuals(0, 3)), 9, 1);
}

TEST(ResidualScatter, IsThatOfTheWorstChannel) {
  ResidualScatter scatter(2);
  Vector both(2 * kRows);
  const Vector good = Residuals(0, 4), bad = 2 * Residuals(0, 5);
  for (int k = 0; k < kRows; ++k) both.segment(2 * k, 2) << good[k], bad[k];
  scatter.Add(both, true);
  EXPECT_NEAR(scatter.Dispersion(), 4, 0.5);
  EXPECT_NEAR(scatter.ChiSquared(), both.squaredNorm(), 1e-12 * both.squaredNorm());
}

// What residuals have in common does not go on from run to run, and 0 is a missing sample.
TEST(ResidualScatter, SkipsMissingSamplesAndTheStepsBetweenRuns) {
  ResidualScatter scatter(1);
  for (int k = 0; k < 1000; ++k) scatter.Add(Vector{{k % 2 == 0 ? 1.0 : -1.0, 0}}, true);
  EXPECT_DOUBLE_EQ(scatter.ChiSquared(), 1000);
  EXPECT_DOUBLE_EQ(scatter.Dispersion(), 1);
}

}  // namespace
}  // namespace polyest::internal::residual_scatter_test
