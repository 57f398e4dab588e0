// Tests the posterior with the correlation of the noise integrated out. The model is a straight
// line, for which everything but that integral has a closed form; the oracle takes it over a finer
// grid, with the covariance of the noise written out.

#include "core/estimator/posterior/noise_marginal.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>
#include <vector>

#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal {
namespace {

constexpr TimeConstantGrid kGridOfMarginal = {0.01, 100};
constexpr int kShortRows = 30;
// The grid reaches as far as the record, to a factor of 1.3 (noise_learning.cc), where so long a
// time constant is not improbable.
constexpr double kLongest = kShortRows - 1;

double Sum(const Vector& probabilities, size_t first, size_t last) {
  return probabilities
      .segment(static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(last - first))
      .sum();
}

TEST(NoiseProbabilities, AreThoseOfTheThreeKinds) {
  const CorrelationProfile profile(kGridOfMarginal, NoiseShape(), 1);
  const Vector p = NoiseProbabilities(profile, kGridOfMarginal);
  EXPECT_NEAR(p[CorrelationProfile::kWhite], 1.0 / 6, 1e-12);
  EXPECT_NEAR(Sum(p, CorrelationProfile::kFirstOfGrid, CorrelationProfile::kFirstMixed), 4.0 / 6,
              1e-12);
  EXPECT_NEAR(Sum(p, CorrelationProfile::kFirstMixed, profile.shapes().size()), 1.0 / 6, 1e-12);
  EXPECT_EQ(p[CorrelationProfile::kPresent], 0);
}

// The present noise takes its part from the nodes beside it.
TEST(NoiseProbabilities, AreRefinedByAPresentNoiseBetweenTheNodes) {
  const double between = std::sqrt(kGridOfMarginal.At(9) * kGridOfMarginal.At(10));
  const CorrelationProfile profile(kGridOfMarginal, {between, 0}, 1);
  const Vector p = NoiseProbabilities(profile, kGridOfMarginal);
  const double inner = 4.0 / 6 / (TimeConstantGrid::kSteps - 1);
  const auto step = [&](int i) {
    return p[static_cast<Eigen::Index>(CorrelationProfile::kFirstOfGrid) + i];
  };
  EXPECT_NEAR(p[CorrelationProfile::kPresent], 0.5 * inner, 1e-12);
  EXPECT_NEAR(step(9), 0.75 * inner, 1e-12);
  EXPECT_NEAR(step(10), 0.75 * inner, 1e-12);
  EXPECT_NEAR(step(11), inner, 1e-12);
  EXPECT_NEAR(step(0), 0.5 * inner, 1e-12);
}

TEST(NoiseProbabilities, AreThoseOfTheRidgeNearANoiseThatIsWhiteInPart) {
  const NoiseShape present = {1, 0.4};
  const CorrelationProfile profile(kGridOfMarginal, present, 1);
  const Vector p = NoiseProbabilities(profile, kGridOfMarginal);
  EXPECT_NEAR(p.sum(), 1, 1e-12);
  EXPECT_EQ(p[CorrelationProfile::kPresent], 0);
  const auto centre = static_cast<Eigen::Index>(CorrelationProfile::kFirstNeighbour) + 4;
  EXPECT_EQ(profile.shapes()[static_cast<size_t>(centre)], present);
  EXPECT_GT(p[centre], 0);
  for (const Eigen::Index other : {1, -1, 5, 6, 7, 8}) EXPECT_EQ(p[centre + other], p[centre]);
  for (const Eigen::Index other : {-4, -3, -2, 2, 3, 4}) EXPECT_EQ(p[centre + other], 0);
}

struct Moments {
  Vector mean = Vector::Zero(2), second = Vector::Zero(2);
  double density = 0;
};

// Adds the posterior for one noise, multiplied by its prior probability.
void Add(const Vector& values, double tau, double share, double probability, Moments& moments) {
  Matrix covariance(kShortRows, kShortRows), line(kShortRows, 2);
  for (int i = 0; i < kShortRows; ++i) {
    line.row(i) << 1, (i + 1.0) / kShortRows;
    for (int j = 0; j < kShortRows; ++j) {
      covariance(i, j) = i == j ? 1 : (1 - share) * std::exp(-std::abs(i - j) / tau);
    }
  }
  const Eigen::LLT<Matrix> noise(covariance);
  const Matrix weighted = noise.solve(line);
  const Eigen::LLT<Matrix> information(weighted.transpose() * line);
  const Vector value = information.solve(weighted.transpose() * values);
  const Vector residual = values - line * value;
  const double chi_squared = residual.dot(noise.solve(residual));
  const auto half_log = [](const Eigen::LLT<Matrix>& factor) {
    return Matrix(factor.matrixL()).diagonal().array().log().sum();
  };
  const double density = probability * std::exp(-half_log(noise) - half_log(information) -
                                                0.5 * (kShortRows - 2) * std::log(chi_squared));
  // The variance of a Student's t with N − 2 degrees of freedom.
  const Vector variance =
      chi_squared / (kShortRows - 4) * information.solve(Matrix::Identity(2, 2)).diagonal();
  moments.density += density;
  moments.mean += density * value;
  moments.second += density * (value.cwiseAbs2() + variance);
}

// Integrates over the noises with a finer grid, at the middles of its cells.
Moments Integrate(const Vector& values) {
  constexpr int kFine = 60;
  const TimeConstantGrid grid = {TimeConstantGrid::kShortestInIntervals, kLongest};
  Moments moments;
  Add(values, 1e-3, 0, 1.0 / 6, moments);
  for (int i = 0; i < kFine; ++i) {
    const double tau =
        grid.shortest_s * std::pow(grid.longest_s / grid.shortest_s, (i + 0.5) / kFine);
    Add(values, tau, 0, 4.0 / 6 / kFine, moments);
    const double edge = std::log(1 / grid.ShareAt(tau, 0) - 1);
    for (int j = 0; j < kFine / 3; ++j) {
      const double odds = std::exp(10.0 / 9 * edge * (6 * (j + 0.5) / kFine - 1));
      Add(values, tau, odds / (1 + odds), 1.0 / 6 / kFine / (kFine / 3), moments);
    }
  }
  moments.mean /= moments.density;
  moments.second /= moments.density;
  return moments;
}

class ShortRecord : public ::testing::TestWithParam<uint64_t> {};

TEST_P(ShortRecord, HasThePosteriorWithTheNoiseIntegratedOut) {
  std::mt19937_64 random(GetParam());
  std::normal_distribution<double> normal;
  const double a = std::exp(-1 / 3.0);
  Vector values(kShortRows);
  double e = normal(random);
  for (int i = 0; i < kShortRows; ++i) {
    values[i] = 1 + 0.5 * (i + 1) / kShortRows + 0.1 * e;
    e = a * e + std::sqrt(1 - a * a) * normal(random);
  }
  Problem problem = TextProblem("a + b*t/duration",
                                {UncertainParameter::Uniform("a", -20, 20).value(),
                                 UncertainParameter::Uniform("b", -20, 20).value()},
                                1);
  problem.fixed["duration"] = kShortRows;
  problem.measured[0].noise = {.unknown = true, .correlation = NoiseCorrelation::kUnknown};
  const auto estimator = Processed(problem, {values.data(), values.data() + values.size()});
  const Estimate estimate = estimator->CurrentEstimate().value();
  const Moments exact = Integrate(values);
  for (Eigen::Index i = 0; i < 2; ++i) {
    const ParameterEstimate& p = estimate.parameters[static_cast<size_t>(i)];
    const double deviation = std::sqrt(exact.second[i] - exact.mean[i] * exact.mean[i]);
    EXPECT_NEAR(p.mean, exact.mean[i], 0.1 * deviation) << p.name;
    EXPECT_NEAR(p.posterior_std_dev / deviation, 1, 0.1) << p.name;
  }
}

INSTANTIATE_TEST_SUITE_P(Records, ShortRecord, ::testing::Values(4, 5, 6, 7));

}  // namespace
}  // namespace polyest::internal
