// Tests expansions that return to the whole prior. The oracle is quadrature: the output is linear
// in all parameters, so that those with normal priors are integrated out in closed form, and the
// posterior of the two lognormal ones is summed over a grid of their germs.

#include "core/estimator/expansion/return_to_prior.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/common/linear_algebra.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::return_to_prior_test {
namespace {

constexpr double kStepOfFall = 0.1;
constexpr int kRows = 200;

constexpr double kSpread = 0.5;  // standard deviations of c and k in units of their means

// A body that two kinds of friction slow down, whose sum the data tell far better than each. The
// posterior is as wide as the prior along a bent curve and thin across it.
Problem SumOfFrictions(double noise) {
  return TextProblem("x + v*t + 4.9*i*t^2 - c*(0.2*t^2 - 0.001*t^3) - k*(0.08*t^2 - 0.0005*t^3)",
                     {UncertainParameter::Lognormal("c", 0.02, 0.02 * kSpread).value(),
                      UncertainParameter::Lognormal("k", 0.01, 0.01 * kSpread).value(),
                      UncertainParameter::Normal("v", 0.4, 0.05).value(),
                      UncertainParameter::Normal("x", 0, 0.01).value(),
                      UncertainParameter::Normal("i", 0, 0.001).value()},
                     noise);
}

// Returns the output's derivatives by c, k, v, x and i (rows × 5).
Matrix Slopes() {
  Matrix slopes(kRows, 5);
  for (int k = 0; k < kRows; ++k) {
    const double t = kStepOfFall * k;
    slopes.row(k) << -0.2 * t * t + 0.001 * t * t * t, -0.08 * t * t + 0.0005 * t * t * t, t, 1,
        4.9 * t * t;
  }
  return slopes;
}

Vector Values(double noise) {
  Vector values = Slopes() * Vector{{0.015, 0.012, 0.41, 0.004, 3e-4}};
  for (int k = 0; k < kRows; ++k) values[k] += std::sqrt(2) * noise * std::sin(17.0 * k);
  return values;
}

struct Moments {
  Vector mean = Vector::Zero(2), std_dev = Vector::Zero(2);
};

// The cost of (c, k) with v, x and i integrated out: ½ θᵀ G θ − rᵀ θ.
struct Marginal {
  Matrix g;
  Vector r;
};
Marginal MarginalOf(double noise) {
  const Matrix slopes = Slopes() / noise;
  const Vector values = Values(noise) / noise;
  const Matrix kept = slopes.leftCols(2), others = slopes.rightCols(3);
  const Vector weight{{1 / (0.05 * 0.05), 1 / (0.01 * 0.01), 1 / (0.001 * 0.001)}};
  const Vector mean{{0.4, 0, 0}};
  const Matrix h = others.transpose() * others + Matrix(weight.asDiagonal());
  const Matrix cross = kept.transpose() * others * Inverse(h);
  const Vector right = others.transpose() * values + weight.cwiseProduct(mean);
  return {kept.transpose() * kept - cross * others.transpose() * kept,
          kept.transpose() * values - cross * right};
}

// The grid's steps are small against the width of the posterior across the curve, 0.1 in the germ
// of c.
Moments Exact(double noise) {
  const Marginal marginal = MarginalOf(noise);
  const double sigma = std::sqrt(std::log1p(kSpread * kSpread));
  const auto lognormal = [&](double mean, double z) {
    return mean * std::exp(sigma * z - 0.5 * sigma * sigma);
  };
  const auto cost = [&](double zc, double zk) {
    const Vector theta{{lognormal(0.02, zc), lognormal(0.01, zk)}};
    return 0.5 * theta.dot(marginal.g * theta) - marginal.r.dot(theta) + 0.5 * (zc * zc + zk * zk);
  };
  constexpr double kReach = 5, kStepOfC = 0.005, kStepOfK = 0.05;
  double least = cost(0, 0);
  Moments moments;
  double mass = 0;
  Vector second = Vector::Zero(2);
  for (const bool sums : {false, true}) {
    for (double zk = -kReach; zk <= kReach; zk += kStepOfK) {
      for (double zc = -kReach; zc <= kReach; zc += kStepOfC) {
        const double height = cost(zc, zk);
        if (!sums) least = std::min(least, height);
        if (!sums || height > least + 40) continue;
        const double weight = std::exp(least - height);
        const Vector theta{{lognormal(0.02, zc), lognormal(0.01, zk)}};
        mass += weight;
        moments.mean += weight * theta;
        second += weight * theta.cwiseAbs2();
      }
    }
  }
  moments.mean /= mass;
  moments.std_dev = (second / mass - moments.mean.cwiseAbs2()).cwiseSqrt();
  return moments;
}

Estimate EstimateOfSum(double noise) {
  Samples samples;
  const Vector values = Values(noise);
  samples.columns = {{"y", {values.begin(), values.end()}, {}}};
  for (int k = 0; k < kRows; ++k) samples.time_s.push_back(kStepOfFall * k);
  return EstimateOf(SumOfFrictions(noise), samples);
}

void ExpectExact(const Estimate& estimate, const Moments& exact) {
  for (int i = 0; i < 2; ++i) {
    const ParameterEstimate& parameter = estimate.parameters[static_cast<size_t>(i)];
    // A mean may be off by what the expansion may shift it by, and by the error of at least a
    // thousand draws, 0.03; the relative error of a standard deviation is of the same size.
    const double tolerance = kAccurateShift + 0.03;
    EXPECT_NEAR(parameter.mean, exact.mean[i], tolerance * exact.std_dev[i]) << i;
    EXPECT_NEAR(parameter.posterior_std_dev, exact.std_dev[i], tolerance * exact.std_dev[i]) << i;
  }
}

// A box around such a posterior reaches far beyond the prior, and no affordable order follows the
// exponential functions there: then every one of these estimates is declared inaccurate. Over the
// whole prior one in ten is, by chance, where the posterior outruns its check points in a window.
TEST(ReturnToPrior, FollowsASumOfLognormalParameters) {
  int followed = 0;
  for (const double noise : {1.2e-3, 1.8e-3, 2.2e-3}) {
    SCOPED_TRACE(noise);
    const Estimate estimate = EstimateOfSum(noise);
    if (Has(estimate, DiagnosticCode::kExpansionInaccurate)) continue;
    ++followed;
    ExpectExact(estimate, Exact(noise));
  }
  EXPECT_GE(followed, 2);
}

}  // namespace
}  // namespace polyest::internal::return_to_prior_test
