// Tests the likelihood of a channel whose noise has an unknown size or correlation. The oracles are
// quadrature over the marginalized quantities and central differences.

#include "core/bayes/mismatch.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace polyest::internal {
namespace {

// Returns log ∫ e^{f(x)} dx by the trapezoidal rule. The rule is exact to rounding for a smooth f
// whose exponential vanishes at both ends.
template <class Function>
double LogIntegral(Function f, double from, double to, int points) {
  std::vector<double> values;
  double largest = -INFINITY;
  for (int i = 0; i <= points; ++i) {
    values.push_back(f(from + (to - from) * i / points));
    largest = std::max(largest, values.back());
  }
  double sum = 0;
  for (const double value : values) sum += std::exp(value - largest);
  return largest + std::log(sum * (to - from) / points);
}

TEST(NegativeLogLikelihood, IsHalfOfChiSquaredWhenTheNoiseIsKnown) {
  EXPECT_EQ(NegativeLogLikelihood(50, 61, 100, false, false), 30.5);
}

TEST(NegativeLogLikelihood, MarginalizesAnUnknownScale) {
  const int n = 15;
  const auto exact = [&](double chi_squared) {
    // The substitution is x = log s: ∫ s^−N e^{−χ²/2s²} ds/s.
    return -LogIntegral([&](double x) { return -n * x - 0.5 * chi_squared * std::exp(-2 * x); }, -6,
                        12, 4000);
  };
  for (const double chi_squared : {3.0, 40.0, 900.0}) {
    EXPECT_NEAR(NegativeLogLikelihood(n, chi_squared, 0, true, false) -
                    NegativeLogLikelihood(n, 15, 0, true, false),
                exact(chi_squared) - exact(15), 1e-9);
  }
  EXPECT_DOUBLE_EQ(NegativeLogLikelihood(n, n, 0, true, false), 0.5 * n);
}

// Holds residuals that end with 0, so that Σ_{k<N} u_k² is all of χ².
struct Residuals {
  explicit Residuals(double correlation) {
    std::mt19937_64 random(7);
    std::normal_distribution<double> normal;
    double before = 0;
    for (int k = 0; k < 20; ++k) {
      const double now = k == 19 ? 0 : correlation * before + normal(random);
      a += now * now;
      b += now * before;
      d += (now - before) * (now - before);
      before = now;
    }
  }
  int n = 20;
  double a = 0, b = 0, d = 0;  // Σ u_k², Σ u_k u_{k−1}, Σ (u_k − u_{k−1})²
};

TEST(NegativeLogLikelihood, MarginalizesAnUnknownCorrelation) {
  // The sum is Σ (u_k − a u_{k−1})² = A − 2 a B + a² A.
  const auto exact = [](const Residuals& u) {
    return -LogIntegral([&](double a) { return -0.5 * (u.a - 2 * a * u.b + a * a * u.a); }, -9, 9,
                        4000) -
           0.5 * std::log(u.a);  // The likelihood leaves out the curvature of the exponent in a.
  };
  const Residuals white(0), red(0.8);
  EXPECT_NEAR(NegativeLogLikelihood(20, red.a, red.d, false, true) -
                  NegativeLogLikelihood(20, white.a, white.d, false, true),
              exact(red) - exact(white), 1e-9);
}

TEST(NegativeLogLikelihood, MarginalizesScaleAndCorrelationTogether) {
  const auto exact = [](const Residuals& u) {
    return -LogIntegral(
        [&](double a) {
          const double square = u.a - 2 * a * u.b + a * a * u.a;
          return LogIntegral([&](double x) { return -u.n * x - 0.5 * square * std::exp(-2 * x); },
                             -5, 8, 800);
        },
        -25, 25, 8000);
  };
  const Residuals white(0), red(0.8);
  // The tails in a fall as a^−N: beyond ±25 lies less than 10⁻²⁰ of the integral.
  EXPECT_NEAR(NegativeLogLikelihood(20, red.a, red.d, true, true) -
                  NegativeLogLikelihood(20, white.a, white.d, true, true),
              exact(red) - exact(white), 1e-8);
}

TEST(NegativeLogLikelihood, StaysFiniteWhereTheFitIsPerfect) {
  EXPECT_TRUE(std::isfinite(NegativeLogLikelihood(20, 0, 0, true, true)));
  EXPECT_TRUE(std::isfinite(NegativeLogLikelihood(0, 0, 0, true, true)));
}

constexpr int kTerms = 4;

ChannelSums RandomChannel(bool scale_unknown, bool correlation_unknown) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  ChannelSums channel(kTerms);
  channel.scale_unknown = scale_unknown;
  channel.correlation_unknown = correlation_unknown;
  Vector before = Vector::Zero(kTerms);
  double error_before = 0;
  for (int k = 0; k < 60; ++k) {
    const Vector c = Vector::NullaryExpr(kTerms, [&] { return normal(random); });
    const double error = 0.6 * error_before + normal(random);
    channel.samples.Add(c, error, 1);
    channel.differences.Add(c - before, error - error_before, 1);
    before = c;
    error_before = error;
  }
  return channel;
}

class MismatchOf : public ::testing::TestWithParam<std::pair<bool, bool>> {
 protected:
  // The second channel has known noise.
  Mismatch mismatch_{std::vector<ChannelSums>{RandomChannel(false, false),
                                              RandomChannel(GetParam().first, GetParam().second)}};
  Vector d_ = Eigen::Vector4d(0.2, -0.1, 0.15, 0.05);
};

TEST_P(MismatchOf, HasTheGradientAndCurvatureOfCentralDifferences) {
  const double h = 1e-5;  // The error is h² J‴ + ε J/h with J of 100.
  Vector gradient(kTerms), forward(kTerms), backward(kTerms);
  EXPECT_DOUBLE_EQ(mismatch_.EvaluateWithGradient(d_, gradient), mismatch_.Evaluate(d_));
  const Matrix curvature = mismatch_.Curvature(d_, Matrix::Identity(kTerms, kTerms));
  for (int i = 0; i < kTerms; ++i) {
    const Vector step = h * Vector::Unit(kTerms, i);
    const double slope = (mismatch_.EvaluateWithGradient(d_ + step, forward) -
                          mismatch_.EvaluateWithGradient(d_ - step, backward)) /
                         (2 * h);
    EXPECT_NEAR(gradient[i], slope, 1e-7 * gradient.norm());
    EXPECT_LT((curvature.col(i) - (forward - backward) / (2 * h)).norm(), 1e-7 * curvature.norm());
  }
}

TEST_P(MismatchOf, OfManyPointsIsThatOfEach) {
  Matrix points(3, kTerms), product;
  points << 0, 0, 0, 0, 0.3, -0.2, 0.1, 0.4, -1, 2, 0.5, 0;
  Vector values(3);
  mismatch_.EvaluateMany(points, product, values);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(values[i], mismatch_.Evaluate(points.row(i).transpose()), 1e-12 * values[i]);
  }
}

INSTANTIATE_TEST_SUITE_P(EveryNoise, MismatchOf,
                         ::testing::Values(std::pair(false, false), std::pair(true, false),
                                           std::pair(false, true), std::pair(true, true)));

// The logarithms of the variances are no square: with a filter whose innovations are smaller than
// the stated noise they make the cost negative.
TEST(Mismatch, AddsLogarithmsOfVariancesThatMakeItNegative) {
  ChannelSums channel = RandomChannel(false, false);
  const Mismatch without(std::vector<ChannelSums>{channel});
  channel.log_variance = Eigen::Vector4d(3, -1, 0.5, 2);
  channel.log_variance_at_reference = -1000;
  const Mismatch with(std::vector<ChannelSums>{channel});
  const Vector d = Eigen::Vector4d(0.2, -0.1, 0.15, 0.05);
  const double added = channel.log_variance.dot(d) - 1000;
  Vector gradient(kTerms), plain(kTerms), values(1);
  Matrix product;
  EXPECT_LT(with.Evaluate(d), -900);
  EXPECT_DOUBLE_EQ(with.Evaluate(d), without.Evaluate(d) + added);
  EXPECT_DOUBLE_EQ(with.EvaluateWithGradient(d, gradient), with.Evaluate(d));
  without.EvaluateWithGradient(d, plain);
  EXPECT_TRUE(gradient.isApprox(plain + channel.log_variance, 1e-14));
  with.EvaluateMany(d.transpose(), product, values);
  EXPECT_NEAR(values[0], with.Evaluate(d), 1e-12 * 1000);
  EXPECT_EQ(NegativeLogLikelihood(60, -40, 0, false, false), -20);
}

TEST(ChannelSums, HasTheLag1CorrelationOfItsResiduals) {
  const Residuals red(0.8);
  ChannelSums channel(1);
  const Vector none = Vector::Zero(1);
  channel.samples.Add(none, std::sqrt(red.a), 1);
  channel.differences.Add(none, std::sqrt(red.d), 1);
  EXPECT_NEAR(channel.Lag1Correlation(none), red.b / red.a, 1e-14);
}

}  // namespace
}  // namespace polyest::internal
