// What a sample of a curved output tells of a normal state. The oracle sums over 400,001 nodes.

#include "core/propagation/output_quadrature.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

#include "core/propagation/heavy_tail.h"

namespace polyest::internal::output_quadrature_test {
namespace {

using Output = std::function<double(double)>;

struct Told {
  double deviance = 0, mean = 0, variance = 0;
};

// σ is 1, and so is p_0 √2π.
Told Take(const Output& h, double z, double sigma, bool tailed = false) {
  OutputQuadrature quadrature(1);
  quadrature.Begin(z, sigma, tailed, Eigen::ArrayXd::Constant(1, sigma * sigma),
                   Eigen::ArrayXd::Zero(1), {true});
  do {
    for (Eigen::Index k = 0; k < OutputQuadrature::kNodes; ++k) {
      quadrature.values()(0, k) = h(quadrature.nodes()(0, k));
    }
  } while (quadrature.Refine());
  EXPECT_TRUE(quadrature.Found(0));
  return {quadrature.Deviance(0), quadrature.Mean(0), quadrature.Variance(0)};
}

// Between `lower` and `upper`, outside which there must be nothing.
Told Sum(const Output& h, double z, double sigma, double lower, double upper, bool tailed = false) {
  constexpr int kCount = 400'000;
  const double step = (upper - lower) / kCount;
  std::vector<double> logs;
  double top = -std::numeric_limits<double>::infinity();
  const auto node = [&](size_t k) { return lower + step * static_cast<double>(k); };
  for (size_t k = 0; k <= kCount; ++k) {
    const double s = node(k), e = (z - h(s)) / sigma;
    const double log = tailed ? -2.5 * std::log1p(e * e / 4) : -0.5 * e * e;
    logs.push_back(log - 0.5 * s * s);
    top = std::max(top, logs.back());
  }
  double sum = 0, mean = 0, square = 0;
  for (size_t k = 0; k < logs.size(); ++k) {
    const double weight = std::exp(logs[k] - top);
    sum += weight;
    mean += weight * node(k);
    square += weight * node(k) * node(k);
  }
  mean /= sum;
  return {-2 * (top + std::log(sum * step / std::sqrt(2 * std::numbers::pi))), mean,
          square / sum - mean * mean};
}

// The rule's own error is 5e-9 for a Gaussian; an integrand's part below e^{−14} of its top is left
// out, and that changes a deviance or a moment in units of the standard deviation by some 1e-5.
void ExpectSame(const Told& told, const Told& exact) {
  EXPECT_NEAR(told.deviance, exact.deviance, 1e-4);
  EXPECT_NEAR(told.mean, exact.mean, 1e-4 * std::sqrt(exact.variance));
  EXPECT_NEAR(told.variance, exact.variance, 2e-4 * exact.variance);
}

TEST(OutputQuadrature, IsKalmansForALinearOutput) {
  for (const double sigma : {1e-6, 0.01, 1.0, 30.0}) {
    for (const double z : {0.0, 2.5, -40.0}) {
      const double c = 1.3, S = c * c + sigma * sigma;
      ExpectSame(Take([&](double s) { return c * s; }, z, sigma),
                 {z * z / S + std::log(S / (sigma * sigma)), c * z / S, sigma * sigma / S});
    }
  }
}

TEST(OutputQuadrature, IntegratesOutputsThatSaturateOrGrow) {
  const Output saturates = [](double s) { return std::tanh(0.4 + 1.5 * s); };
  const Output grows = [](double s) { return std::exp(0.8 * s); };
  for (const double sigma : {0.02, 0.1, 0.5}) {
    for (const double z : {-0.99, 0.3, 0.97, 1.02}) {
      ExpectSame(Take(saturates, z, sigma), Sum(saturates, z, sigma, -9, 9));
    }
    for (const double z : {-0.05, 0.4, 9.0}) {
      ExpectSame(Take(grows, z, sigma), Sum(grows, z, sigma, -9, 9));
    }
  }
}

// Two peaks, and what is far beyond the first nodes.
TEST(OutputQuadrature, FindsPeaksApartAndFarOff) {
  const Output square = [](double s) { return s * s; };
  ExpectSame(Take(square, 2, 0.1), Sum(square, 2, 0.1, -9, 9));
  const Output cube = [](double s) { return s + 0.01 * s * s * s; };
  ExpectSame(Take(cube, 100, 0.5), Sum(cube, 100, 0.5, 0, 40));
}

TEST(OutputQuadrature, LeavesOutWhereTheOutputHasNoValue) {
  const Output root = [](double s) { return std::sqrt(0.5 + s); };
  const Output none = [](double s) { return s < -0.5 ? 1e9 : std::sqrt(0.5 + s); };
  ExpectSame(Take(root, 1, 0.1), Sum(none, 1, 0.1, -9, 9));
  OutputQuadrature nowhere(1);
  nowhere.Begin(0, 1, false, Eigen::ArrayXd::Ones(1), Eigen::ArrayXd::Zero(1), {true});
  nowhere.values().setConstant(std::numeric_limits<double>::quiet_NaN());
  EXPECT_FALSE(nowhere.Refine());
  EXPECT_FALSE(nowhere.Found(0));
}

// HeavyTail's own sum is that of t to 1 % in the density.
TEST(OutputQuadrature, TakesStudentsT) {
  const Output saturates = [](double s) { return std::tanh(0.4 + 1.5 * s); };
  for (const double z : {0.3, 1.4, 3.0}) {
    ExpectSame(Take(saturates, z, 0.1, true), Sum(saturates, z, 0.1, -9, 9, true));
  }
  const HeavyTail tail;
  const double c = 0.7, sigma = 0.2;
  for (const double z : {0.1, 2.0, 5.0}) {
    const Told told = Take([&](double s) { return c * s; }, z, sigma, true);
    const HeavyTail::Result result = tail.Take(z, c * c, sigma, sigma);
    EXPECT_NEAR(told.deviance, result.innovation * result.innovation + result.log_variance, 0.02);
    EXPECT_NEAR(told.mean, c * z / result.gain_variance, 0.01);
    EXPECT_NEAR(told.variance, 1 - c * c / result.spread, 0.01);
  }
}

}  // namespace
}  // namespace polyest::internal::output_quadrature_test
