// Tests noise that is white in part and correlated for the rest, as of a sensor on a model with a
// slow error. The model is a straight line, whose estimate for a known covariance is generalized
// least squares. The oracle takes the covariance from the precision of the correlated part, which
// is tridiagonal for regular samples, and not from the filter.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::white_share_test {
namespace {

using ::testing::HasSubstr;

constexpr double kInterval = 0.01;  // s
constexpr int kRows = 6000;
constexpr double kDuration = kInterval * kRows;

// The variance of the noise, its white share and the time constant of the rest.
struct Noise {
  double deviation = 0.1;
  double share = 0.5;
  double time_constant_s = 2;
};

Problem LineProblem(const NoiseModel& noise) {
  Problem problem = TextProblem("a + b*t/duration",
                                {UncertainParameter::Uniform("a", -10, 10).value(),
                                 UncertainParameter::Uniform("b", -10, 10).value()},
                                1);
  problem.fixed["duration"] = kDuration;
  problem.measured[0].noise = noise;
  return problem;
}

// Returns 1 + ½ t/T with noise.
Samples Line(const Noise& noise, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Samples samples;
  samples.columns = {{"y", {}, {}}};
  const double a = noise.time_constant_s > 0 ? std::exp(-kInterval / noise.time_constant_s) : 0;
  double slow = normal(random);
  for (int k = 1; k <= kRows; ++k) {
    const double t = kInterval * k;
    slow = a * slow + std::sqrt(1 - a * a) * normal(random);
    const double e = std::sqrt(noise.share) * normal(random) + std::sqrt(1 - noise.share) * slow;
    samples.time_s.push_back(t);
    samples.columns[0].value.push_back(1 + 0.5 * t / kDuration + noise.deviation * e);
  }
  return samples;
}

// The symmetric matrix with `inner` on the diagonal, `end` at its ends and `beside` next to it.
struct Tridiagonal {
  double inner, end, beside;

  double Diagonal(int k) const { return k == 0 || k == kRows - 1 ? end : inner; }
  Matrix Times(const Matrix& x) const {
    Matrix y = inner * x;
    y.row(0) = end * x.row(0);
    y.row(kRows - 1) = end * x.row(kRows - 1);
    y.topRows(kRows - 1) += beside * x.bottomRows(kRows - 1);
    y.bottomRows(kRows - 1) += beside * x.topRows(kRows - 1);
    return y;
  }
  // Returns the inverse times x and adds the logarithm of the determinant.
  Matrix Solve(Matrix x, double& log_determinant) const {
    Vector pivot(kRows);
    for (int k = 0; k < kRows; ++k) {
      pivot[k] = Diagonal(k);
      if (k > 0) {
        pivot[k] -= beside * beside / pivot[k - 1];
        x.row(k) -= beside / pivot[k - 1] * x.row(k - 1);
      }
      log_determinant += std::log(pivot[k]);
    }
    for (int k = kRows - 1; k >= 0; --k) {
      if (k < kRows - 1) x.row(k) -= beside * x.row(k + 1);
      x.row(k) /= pivot[k];
    }
    return x;
  }
};

struct Fit {
  Vector value;                        // a, b
  Vector deviation;                    // their standard deviations
  double negative_log_likelihood = 0;  // with a and b integrated out, up to a constant
  double chi_squared = 0;
};

// Generalized least squares. With Q the precision of the correlated part, K = σ² (f + (1 − f) Q⁻¹)
// has the inverse Q (f Q + 1 − f)⁻¹/σ².
Fit GeneralizedLeastSquares(const Samples& line, const Noise& noise) {
  const double a = std::exp(-kInterval / noise.time_constant_s);
  const double f = noise.share, q = 1 / (1 - a * a);
  const Tridiagonal precision = {(1 + a * a) * q, q, -a * q};
  const Tridiagonal sum = {f * precision.inner + 1 - f, f * q + 1 - f, f * precision.beside};
  Matrix columns(kRows, 3);  // ∂y/∂a, ∂y/∂b, z
  for (int k = 0; k < kRows; ++k) {
    const auto row = static_cast<size_t>(k);
    columns.row(k) << 1, line.time_s[row] / kDuration, line.columns[0].value[row];
  }
  double log_determinant = (kRows - 1) * std::log(1 - a * a);
  const Matrix weighted = precision.Times(sum.Solve(columns, log_determinant));
  const double variance = noise.deviation * noise.deviation;
  const Matrix gram = columns.transpose() * weighted / variance;
  const Eigen::LLT<Matrix> information(gram.topLeftCorner(2, 2));
  Fit fit;
  fit.value = information.solve(gram.col(2).head(2));
  fit.deviation = information.solve(Matrix::Identity(2, 2)).diagonal().cwiseSqrt();
  fit.chi_squared = gram(2, 2) - fit.value.dot(gram.col(2).head(2));
  fit.negative_log_likelihood =
      0.5 * (kRows * std::log(variance) + log_determinant + fit.chi_squared) +
      Matrix(information.matrixL()).diagonal().array().log().sum();
  return fit;
}

// The noise in coordinates without bounds: log σ, log f/(1 − f), log τ.
Vector Coordinates(const Noise& noise) {
  Vector x(3);
  x << std::log(noise.deviation), std::log(noise.share / (1 - noise.share)),
      std::log(noise.time_constant_s);
  return x;
}
Noise At(const Vector& x) { return {std::exp(x[0]), 1 / (1 + std::exp(-x[1])), std::exp(x[2])}; }

// The likelihood's derivatives at a noise, by differences.
struct Curvature {
  Vector gradient;  // of −log L
  Matrix hessian;   // of −log L
  Vector widening;  // gradient of the logarithm of a's standard deviation
};

Curvature CurvatureAt(const Samples& line, const Noise& noise) {
  constexpr double h = 0.02;
  const auto at = [&](int i, double s, int j, double t) {
    Vector x = Coordinates(noise);
    x[i] += h * s;
    x[j] += h * t;
    return GeneralizedLeastSquares(line, At(x));
  };
  Curvature curvature{Vector(3), Matrix(3, 3), Vector(3)};
  const double middle = at(0, 0, 0, 0).negative_log_likelihood;
  for (int i = 0; i < 3; ++i) {
    const Fit up = at(i, 1, i, 0), down = at(i, -1, i, 0);
    curvature.gradient[i] = (up.negative_log_likelihood - down.negative_log_likelihood) / (2 * h);
    curvature.widening[i] = std::log(up.deviation[0] / down.deviation[0]) / (2 * h);
    curvature.hessian(i, i) =
        (up.negative_log_likelihood - 2 * middle + down.negative_log_likelihood) / (h * h);
    for (int j = 0; j < i; ++j) {
      const auto f = [&](double s, double t) { return at(i, s, j, t).negative_log_likelihood; };
      curvature.hessian(i, j) = curvature.hessian(j, i) =
          (f(1, 1) - f(1, -1) - f(-1, 1) + f(-1, -1)) / (4 * h * h);
    }
  }
  return curvature;
}

// Returns the 2.5 % and 97.5 % quantiles of a and b, as rows, with the noise integrated out: its
// size with the density 1/σ, log τ and log f/(1 − f) with a uniform one, up to a τ of the length of
// the record and 2^2.5 times that of the noise learned. The sum is over log τ and log f τ/(1 − f),
// which the record knows almost independently of τ.
Matrix IntegratedIntervals(const Samples& line, const Noise& learned) {
  std::vector<Fit> fits;
  std::vector<double> densities;
  const double reach = std::exp2(2.5);
  const double longest_s = std::min(kDuration, reach * learned.time_constant_s);
  for (double tau = longest_s; tau > learned.time_constant_s / reach; tau /= 1.15) {
    for (int i = -4; i <= 4; ++i) {
      const double odds = learned.share / (1 - learned.share) * learned.time_constant_s / tau;
      const double ratio = odds * std::exp(0.2 * i);
      Fit fit = GeneralizedLeastSquares(line, {1, ratio / (1 + ratio), tau});
      // ∫ σ^−(N−2) e^−½χ²/σ² dσ/σ is (χ²)^−½(N−2) up to a constant.
      densities.push_back(-fit.negative_log_likelihood + 0.5 * fit.chi_squared -
                          0.5 * (kRows - 2) * std::log(fit.chi_squared));
      fit.deviation *= std::sqrt(fit.chi_squared / (kRows - 2));
      fits.push_back(fit);
    }
  }
  const double top = *std::ranges::max_element(densities);
  Matrix quantiles(2, 2);
  for (Eigen::Index i = 0; i < 2; ++i) {
    for (const double probability : {0.025, 0.975}) {
      double low = -10, high = 10;
      for (int step = 0; step < 40; ++step) {
        const double middle = 0.5 * (low + high);
        double below = 0, all = 0;
        for (size_t k = 0; k < fits.size(); ++k) {
          const double density = std::exp(densities[k] - top);
          const double z = (middle - fits[k].value[i]) / fits[k].deviation[i];
          all += density;
          below += density * 0.5 * std::erfc(-z / std::sqrt(2.0));
        }
        (below < probability * all ? low : high) = middle;
      }
      quantiles(i, probability < 0.5 ? 0 : 1) = low;
    }
  }
  return quantiles;
}

Noise NoiseOf(const Estimate& estimate) {
  const ChannelEstimate& channel = estimate.channels[0];
  return {channel.noise_std_dev, channel.noise_white_share, channel.noise_time_constant_s};
}

constexpr NoiseModel kAllUnknown{.unknown = true, .correlation = NoiseCorrelation::kUnknown};

class WhiteShare : public ::testing::TestWithParam<uint64_t> {};

TEST_P(WhiteShare, IsLearnedWithTheTimeConstantAndTheSize) {
  const Noise truth{.deviation = 0.1 * std::sqrt(2.0)};
  const Samples line = Line(truth, GetParam());
  const Estimate estimate = EstimateOf(LineProblem(kAllUnknown), line);
  const Noise found = NoiseOf(estimate);
  ASSERT_GT(found.share, 0);
  // A noise is not revised for a gain of ¼, and the last revision may have seen a part 1/1.3 of the
  // record only, which leaves 0.3 of a χ² of three degrees of freedom; that is above 16.3 for one
  // record in a thousand.
  const Curvature there = CurvatureAt(line, found);
  const double gain = 0.5 * there.gradient.dot(there.hessian.llt().solve(there.gradient));
  EXPECT_LT(gain, 0.25 + 0.5 * 0.3 * 16.3);
  // So is twice the gain over the truth.
  const Fit exact = GeneralizedLeastSquares(line, truth);
  const Fit with_found = GeneralizedLeastSquares(line, found);
  EXPECT_LT(exact.negative_log_likelihood - with_found.negative_log_likelihood, 0.5 * 16.3);
  const Matrix integrated = IntegratedIntervals(line, found);
  // How well the record knows the width of an interval.
  const double unsure = std::sqrt(there.widening.dot(there.hessian.llt().solve(there.widening)));
  for (Eigen::Index i = 0; i < 2; ++i) {
    const ParameterEstimate& p = estimate.parameters[static_cast<size_t>(i)];
    // The estimator integrates by steps of a factor 2 of the time constant.
    const double half = 0.5 * (integrated(i, 1) - integrated(i, 0));
    EXPECT_NEAR(p.lower95, integrated(i, 0), 0.1 * half) << p.name;
    EXPECT_NEAR(p.upper95, integrated(i, 1), 0.1 * half) << p.name;
    EXPECT_NEAR(1.96 * p.std_dev / half, 1, 0.1) << p.name;
    EXPECT_NEAR(std::log(p.std_dev / exact.deviation[i]), 0, 3 * unsure) << p.name;
    EXPECT_NEAR(p.mean, exact.value[i], 0.3 * exact.deviation[i]) << p.name;
  }
  EXPECT_FALSE(Has(estimate, DiagnosticCode::kModelMisfit));
  EXPECT_FALSE(Has(estimate, DiagnosticCode::kWindowsDisagree));
}

// With the size known, the record knows the rest to a tenth.
TEST_P(WhiteShare, GivesTheExactPosteriorWhereTheSizeIsKnown) {
  const Noise truth{.deviation = 0.1 * std::sqrt(2.0)};
  const Samples line = Line(truth, GetParam());
  const Estimate estimate = EstimateOf(
      LineProblem({.absolute = truth.deviation, .correlation = NoiseCorrelation::kUnknown}), line);
  const Fit exact = GeneralizedLeastSquares(line, truth);
  for (Eigen::Index i = 0; i < 2; ++i) {
    const ParameterEstimate& p = estimate.parameters[static_cast<size_t>(i)];
    EXPECT_NEAR(p.std_dev / exact.deviation[i], 1, 0.2) << p.name;
    EXPECT_NEAR(p.mean, exact.value[i], 0.3 * exact.deviation[i]) << p.name;
  }
}

TEST_P(WhiteShare, IsNoneWhereAllOfTheNoiseIsCorrelated) {
  const Estimate estimate =
      EstimateOf(LineProblem(kAllUnknown), Line({.share = 0, .time_constant_s = 0.1}, GetParam()));
  EXPECT_EQ(estimate.channels[0].noise_white_share, 0);
  // log τ is known to √((1 − a²)/N)/(a Δt/τ).
  const double a = std::exp(-kInterval / 0.1);
  const double unsure = std::sqrt((1 - a * a) / kRows) / (a * kInterval / 0.1);
  EXPECT_NEAR(std::log(estimate.channels[0].noise_time_constant_s / 0.1), 0, 3 * unsure + 0.05);
}

TEST_P(WhiteShare, IsNoneWhereNoneOfTheNoiseIsCorrelated) {
  const Estimate estimate = EstimateOf(LineProblem(kAllUnknown), Line({.share = 1}, GetParam()));
  EXPECT_EQ(estimate.channels[0].noise_white_share, 0);
  // The standard deviations of a and b of white noise are 2σ/√N and √12 σ/√N.
  const double unit = 0.1 / std::sqrt(kRows);
  EXPECT_NEAR(estimate.parameters[0].std_dev / (2 * unit), 1, 0.1);
  EXPECT_NEAR(estimate.parameters[1].std_dev / (std::sqrt(12.0) * unit), 1, 0.1);
}

INSTANTIATE_TEST_SUITE_P(Records, WhiteShare, ::testing::Values(1, 2, 3));

TEST(KnownWhiteShare, GivesTheExactPosterior) {
  const Noise truth{.deviation = 0.2, .share = 0.8, .time_constant_s = 0.5};
  const Samples line = Line(truth, 4);
  const Estimate estimate = EstimateOf(LineProblem({.absolute = truth.deviation,
                                                    .correlation = NoiseCorrelation::kKnown,
                                                    .time_constant_s = truth.time_constant_s,
                                                    .white_share = truth.share}),
                                       line);
  const Fit exact = GeneralizedLeastSquares(line, truth);
  for (Eigen::Index i = 0; i < 2; ++i) {
    const ParameterEstimate& p = estimate.parameters[static_cast<size_t>(i)];
    EXPECT_NEAR(p.map, exact.value[i], 0.01 * exact.deviation[i]) << p.name;
    EXPECT_NEAR(p.posterior_std_dev, exact.deviation[i], 0.03 * exact.deviation[i]) << p.name;
  }
  const ChannelEstimate& channel = estimate.channels[0];
  EXPECT_EQ(channel.noise_white_share, 0.8);
  EXPECT_EQ(channel.noise_time_constant_s, 0.5);
  // The variance of a mean is f + (1 − f)(1 + a)/(1 − a) times that of independent samples.
  const double a = std::exp(-kInterval / 0.5);
  EXPECT_NEAR(channel.effective_samples, kRows / (0.8 + 0.2 * (1 + a) / (1 - a)), 1e-6 * kRows);
  EXPECT_TRUE(estimate.diagnostics.empty());
}

// The time constant of a random walk is mostly found to be a large part of the record.
TEST(SlowNoise, IsSaidToLastForALargePartOfTheRecord) {
  int said = 0;
  for (uint64_t seed = 1; seed <= 4; ++seed) {
    const Estimate estimate =
        EstimateOf(LineProblem(kAllUnknown), Line({.time_constant_s = 1e3}, seed));
    const std::string message = Message(estimate, DiagnosticCode::kNoiseNotLearned);
    if (message.find("of its variance is correlated over") != std::string::npos) ++said;
  }
  EXPECT_GE(said, 1);
}

}  // namespace
}  // namespace polyest::internal::white_share_test
