// Samples whose noise has Student's t distribution. The oracle integrates over the output by the
// trapezoidal rule on a fine grid.

#include "core/propagation/heavy_tail.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <unsupported/Eigen/MatrixFunctions>
#include <vector>

#include "core/propagation/filter_bank.h"
#include "tests/unit/core/propagation/driven_oscillators.h"

namespace polyest::internal::heavy_tail_test {
namespace {

constexpr double kSigma = 0.02;
// That of the nodes in log λ: the step allows 2e-6 in all, and what λ is below the first node
// λ_1 has the share (½ λ_1 (e/σ)²)^2.5/2.5 Γ(2.5) = 4e-6 of the density at e = 24 σ.
constexpr double kRelative = 1e-5;

double Density(double t) { return 0.375 * std::pow(1 + t * t / 4, -2.5); }

// The distribution of an output with the variance a about 0 after a sample at e: the density of the
// sample, and mean and variance of the output.
struct Moments {
  double density = 0, mean = 0, variance = 0;
};

Moments Integrate(double e, double a, double sigma) {
  Moments moments;
  if (a == 0) return {Density(e / sigma) / sigma, 0, 0};
  const double root = std::sqrt(a), step = std::min(root, sigma) / 50;
  double first = 0, second = 0;
  for (double y = -9 * root; y < 9 * root; y += step) {
    const double prior = std::exp(-0.5 * y * y / a) / (root * std::sqrt(2 * std::numbers::pi));
    const double weight = step * prior * Density((e - y) / sigma) / sigma;
    moments.density += weight;
    first += weight * y;
    second += weight * y * y;
  }
  moments.mean = first / moments.density;
  moments.variance = second / moments.density - moments.mean * moments.mean;
  return moments;
}

TEST(HeavyTail, GivesTheMomentsAndTheDensityOfTheIntegral) {
  const HeavyTail tail;
  for (const double a : {0.0, 0.04, 0.25, 9.0}) {
    for (const double e : {0.0, 0.01, -0.4, 1.3, -5.0, 12.0}) {
      const Moments exact = Integrate(e, a, 0.5);
      const HeavyTail::Result result = tail.Take(e, a, 0.5, 0.5);
      EXPECT_NEAR(a / result.gain_variance * e, exact.mean, kRelative * std::sqrt(a))
          << a << ' ' << e;
      EXPECT_NEAR(a - a * a / result.spread, exact.variance, kRelative * a) << a << ' ' << e;
      // −log p = ½ w² + ½ l − log p_0
      const double log_density = std::log(0.375 / 0.5) -
                                 0.5 * result.innovation * result.innovation -
                                 0.5 * result.log_variance;
      EXPECT_NEAR(log_density, std::log(exact.density), kRelative) << a << ' ' << e;
      EXPECT_EQ(std::signbit(result.innovation), std::signbit(e));
      // The vectors x − K y and √R K, with K = a/V and x = y, of the output itself.
      const double gain = a / result.gain_variance;
      EXPECT_NEAR((1 - gain) * (1 - gain) * a + result.noise_variance * gain * gain, exact.variance,
                  kRelative * a)
          << a << ' ' << e;
    }
  }
}

// Relative deviations from a Gaussian are of the order of 1/ν.
TEST(HeavyTail, IsAGaussianWithManyDegreesOfFreedom) {
  const HeavyTail tail(1e8);
  for (const double a : {0.0, 0.3, 5.0}) {
    for (const double e : {0.0, 0.2, -3.0}) {
      const HeavyTail::Result result = tail.Take(e, a, 0.5, 0.25);
      const double S = a + 0.25;
      EXPECT_NEAR(result.innovation, e / std::sqrt(S), 1e-5);
      EXPECT_NEAR(result.log_variance, std::log(S / 0.0625), 1e-6);
      EXPECT_NEAR(result.gain_variance, S, 1e-5 * S);
      EXPECT_NEAR(result.spread, S, 1e-4 * S);
      EXPECT_NEAR(result.noise_variance, 0.25, 1e-4);
    }
  }
}

TEST(HeavyTail, LeavesTheStateWhereItIsForAWildSample) {
  const HeavyTail tail;
  double last = 0;
  for (const double e : {1e1, 1e3, 1e6, 1e12, 1e100, 1e200}) {
    const HeavyTail::Result result = tail.Take(e, 1, 1, 1);
    EXPECT_TRUE(std::isfinite(result.innovation));
    EXPECT_GT(result.innovation, last);
    last = result.innovation;
    if (e == 1e3) {
      EXPECT_LT(1 / result.gain_variance * e, 0.05);
      EXPECT_NEAR(1 - 1 / result.spread, 1, 0.01);
    }
  }
}

// The oscillator's states after samples of x, by the moments of the integral.
struct States {
  Eigen::Vector2d mean;
  Eigen::Matrix2d covariance = Eigen::Matrix2d::Zero();
  std::vector<double> costs;  // ½ w² + ½ l of each sample
};

std::vector<double> Values(int count) {
  std::vector<double> values;
  for (int k = 0; k < count; ++k) {
    const double wild = k % 7 == 4 ? 20 * kSigma : 0;
    values.push_back(std::cos(0.315 * (k + 1)) + kSigma * std::sin(5.0 * k) + wild);
  }
  return values;
}

States Exact(const DrivenOscillator& oscillator, double step_s, const std::vector<double>& values) {
  Eigen::Matrix2d A, q = Eigen::Matrix2d::Zero();
  A << 0, 1, -oscillator.k, -oscillator.c;
  q(1, 1) = oscillator.q;
  const Eigen::Matrix2d whole = (A * step_s).exp(), half = (A * step_s / 2).exp();
  States states;
  states.mean = {oscillator.x0, oscillator.v0};
  Eigen::Matrix2d& P = states.covariance;
  for (const double z : values) {
    states.mean = whole * states.mean;
    P = whole * P * whole.transpose() +
        step_s / 6 * (whole * q * whole.transpose() + 4 * half * q * half.transpose() + q);
    const double a = P(0, 0);
    const Moments moments = Integrate(z - states.mean[0], a, kSigma);
    states.costs.push_back(std::log(0.375 / kSigma) - std::log(moments.density));
    const Eigen::Vector2d by = P.col(0) / a;
    states.mean += by * moments.mean;
    P += by * by.transpose() * (moments.variance - a);
  }
  return states;
}

const std::vector<DrivenOscillator> kOscillators = {{40, 0.3, 1, 0, 0.01}, {36, 0.2, 0.9, 1, 0.1}};

TEST(HeavyTail, MakesTheFiltersThoseOfTheIntegral) {
  constexpr int kRows = 25;
  constexpr double kStepS = 0.05;
  const std::vector<double> values = Values(kRows);
  std::vector<double> times_s;
  for (int k = 0; k < kRows; ++k) times_s.push_back((k + 1) * kStepS);
  Ensemble ensemble = DrivenOscillatorEnsemble(kOscillators, {"x"});
  ensemble.specification.heavy_tailed = {true};
  FilterBank bank(ensemble.specification, &ensemble.inputs);
  const Matrix samples = Eigen::Map<const Matrix>(values.data(), 1, kRows);
  const Matrix noise = Matrix::Constant(1, kRows, kSigma);
  Matrix w(2, kRows), l(2, kRows), means, deviations;
  ASSERT_TRUE(bank.Advance({times_s, samples, noise}, w, l, Stop()).ok());
  bank.ReadStates(means, deviations);
  for (Eigen::Index i = 0; i < 2; ++i) {
    const States exact = Exact(kOscillators[static_cast<size_t>(i)], kStepS, values);
    for (int k = 0; k < kRows; ++k) {
      EXPECT_NEAR(0.5 * w(i, k) * w(i, k) + 0.5 * l(i, k), exact.costs[static_cast<size_t>(k)],
                  1e-4)
          << i << ' ' << k;
    }
    for (int s = 0; s < 2; ++s) {
      const double deviation = std::sqrt(exact.covariance(s, s));
      EXPECT_NEAR(means(i, s), exact.mean[s], 1e-4 * deviation);
      EXPECT_NEAR(deviations(i, s), deviation, 1e-4 * deviation);
    }
  }
}

// What a sample tells of its own instant is the same for a filter and a smoother.
TEST(HeavyTail, IsTakenBySmoothersAsByFilters) {
  for (const double wild : {0.0, 4.0, 20.0}) {
    Ensemble ensemble = DrivenOscillatorEnsemble(kOscillators, {"x"});
    ensemble.specification.heavy_tailed = {true};
    FilterBank smoother(ensemble.specification, &ensemble.inputs);
    FilterBank filter(ensemble.specification, &ensemble.inputs);
    const double t = 0.3;
    const Matrix value = Matrix::Constant(1, 1, std::cos(6.3 * t) + wild * kSigma);
    const Matrix noise = Matrix::Constant(1, 1, kSigma);
    Matrix w(2, 1), l(2, 1), means(2, 1), deviations(2, 1), expected, expected_deviations;
    smoother.StartBackward();
    ASSERT_TRUE(smoother.Mark(t, Stop()).ok());
    ASSERT_TRUE(smoother.Advance({{&t, 1}, value, noise}, w, l, Stop()).ok());
    ASSERT_TRUE(filter.Advance({{&t, 1}, value, noise}, w, l, Stop()).ok());
    smoother.FinishBackward();
    ASSERT_TRUE(smoother.ReadMarked(0, t, means, deviations).ok());
    filter.ReadStates(expected, expected_deviations);
    for (Eigen::Index i = 0; i < 2; ++i) {
      EXPECT_NEAR(means(i, 0), expected(i, 0), 1e-9);
      EXPECT_NEAR(deviations(i, 0), expected_deviations(i, 0), 1e-9);
    }
  }
}

}  // namespace
}  // namespace polyest::internal::heavy_tail_test
