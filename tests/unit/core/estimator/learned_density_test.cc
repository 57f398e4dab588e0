// Tests what is said of a process noise whose density is learned where there is none: the posterior
// averages over the densities that the record allows, and of the density only a limit is known. The
// oracle is the exact likelihood on a grid of densities (forced_oscillator.h).

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/unit/core/estimator/forced_oscillator.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

constexpr double kLower = 1e-7, kUpper = 1;

// What a log-uniform prior of the density and the record leave, exactly.
struct Mixture {
  Vector mean, std_dev;          // of k and c
  double logarithm_below95 = 0;  // 97.5 % quantile of the density's logarithm
};

// For a given density, the posterior of k and c is Gaussian: their priors are flat and wide.
Mixture MixtureOf(const Samples& samples) {
  constexpr int kCells = 80;
  const double width = std::log(kUpper / kLower) / kCells;
  std::vector<double> weights;
  Matrix means(kCells, 2), deviations(kCells, 2);
  Vector guess{{kTrueK, kTrueC}};
  for (int cell = 0; cell < kCells; ++cell) {
    const double logarithm = std::log(kLower) + (cell + 0.5) * width;
    const Maximum found = Minimize(
        [&](const Vector& at) {
          return ExactCost(samples, {at[0], at[1], logarithm});
        },
        guess, Vector{{0.02, 0.004}});
    guess = found.at;
    means.row(cell) = found.at;
    deviations.row(cell) = found.std_dev;
    weights.push_back(found.log_volume - found.cost);
  }
  const double most = std::ranges::max(weights);
  Vector share(kCells);
  for (int cell = 0; cell < kCells; ++cell) {
    share[cell] = std::exp(weights[static_cast<size_t>(cell)] - most);
  }
  share /= share.sum();
  Mixture mixture;
  mixture.mean = means.transpose() * share;
  const Vector square =
      (means.cwiseAbs2() + deviations.cwiseAbs2()).transpose() * share - mixture.mean.cwiseAbs2();
  mixture.std_dev = square.cwiseSqrt();
  double below = 0;
  for (int cell = 0; cell < kCells; ++cell) {
    const double part = std::min(1.0, (0.975 - below) / share[cell]);
    below += share[cell];
    mixture.logarithm_below95 = std::log(kLower) + (cell + part) * width;
    if (part < 1) break;
  }
  return mixture;
}

// The draws carry the accuracy of 1 %, the expansion a bit more.
TEST(LearnedDensity, IsAveragedOverWhereThereIsNoProcessNoise) {
  const Samples samples = Measure(400, 0, 2);
  const Mixture exact = MixtureOf(samples);
  Problem problem = ForcedOscillator();
  problem.process_noise = {{.state = "v", .unknown = true, .lower = kLower, .upper = kUpper}};
  const Estimate estimate = EstimateOf(problem, samples);
  for (Eigen::Index i = 0; i < 2; ++i) {
    const ParameterEstimate& parameter = estimate.parameters[static_cast<size_t>(i)];
    EXPECT_NEAR(parameter.mean, exact.mean[i], 0.05 * exact.std_dev[i]) << parameter.name;
    EXPECT_NEAR(parameter.posterior_std_dev, exact.std_dev[i], 0.05 * exact.std_dev[i]);
  }
  // The cost hardly depends on densities below the limit, so that its curvature says nothing.
  const ParameterEstimate& density = estimate.parameters[2];
  EXPECT_NEAR(std::log(density.upper95), exact.logarithm_below95, 0.1);
  EXPECT_EQ(density.std_dev, density.posterior_std_dev);
  EXPECT_NEAR(estimate.covariance(2, 2), std::pow(density.std_dev, 2),
              1e-9 * std::pow(density.std_dev, 2));
  EXPECT_THAT(Message(estimate, DiagnosticCode::kNonGaussian),
              HasSubstr("what is reported is the posterior's"));
  EXPECT_FALSE(Has(estimate, DiagnosticCode::kMultipleMinima));
}

}  // namespace
}  // namespace polyest::internal
