// Tests the robust covariance and the test of constancy on linear least squares, for which the
// scores of windows have a closed form.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/common/linear_algebra.h"
#include "core/estimator/posterior/constancy.h"
#include "core/estimator/posterior/robust_covariance.h"

namespace polyest::internal::window_statistics_test {
namespace {

constexpr int kWindows = 32;
constexpr int kRowsOfWindow = 50;
constexpr int kRows = kWindows * kRowsOfWindow;

// Row k of a regression on two sinusoids.
Vector Regressor(int k) { return (Vector(2) << std::sin(0.7 * k), std::cos(0.3 * k)).finished(); }

// Returns the scores at the least-squares solution for residuals `error` of unit noise.
std::vector<WindowScore> ScoresOf(const Vector& error) {
  Matrix information = Matrix::Zero(2, 2);
  Vector gradient = Vector::Zero(2);
  for (int k = 0; k < kRows; ++k) {
    information += Regressor(k) * Regressor(k).transpose();
    gradient += Regressor(k) * error[k];
  }
  const Vector fit = CholeskyFactor(information).Solve(gradient);
  std::vector<WindowScore> windows;
  for (int w = 0; w < kWindows; ++w) {
    WindowScore window{
        {kRowsOfWindow, 0, 0, 1.0 * w, w + 0.98}, Vector::Zero(2), Matrix::Zero(2, 2)};
    for (int k = w * kRowsOfWindow; k < (w + 1) * kRowsOfWindow; ++k) {
      window.score -= Regressor(k) * (error[k] - Regressor(k).dot(fit));
      window.information += Regressor(k) * Regressor(k).transpose();
    }
    windows.push_back(std::move(window));
  }
  return windows;
}

Vector WhiteNoise(uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  return Vector::NullaryExpr(kRows, [&] { return normal(generator); });
}

const Matrix& Precision() {
  static const Matrix precision = 1e-6 * Matrix::Identity(2, 2);
  return precision;
}

const Vector kFlat = Vector::Zero(2);  // the gradient of a prior that says nothing

TEST(RobustCovariance, IsTheModelsOwnForWhiteNoise) {
  double mean = 0;
  constexpr int kSeeds = 200;
  for (int seed = 0; seed < kSeeds; ++seed) {
    const RobustCovariance robust = RobustCovarianceOf(ScoresOf(WhiteNoise(seed)), Precision());
    EXPECT_FALSE(robust.significant && robust.disagreement > 2) << seed;
    mean += robust.ratio[0] / kSeeds;
  }
  // A standard deviation from 16 or 32 windows has a standard error of at most 1/√(2·15) = 18 %.
  // The choice of the length with the largest eigenvalue raises its mean, by at most half of that.
  EXPECT_NEAR(mean, 1.05, 0.07);
}

// Residuals of autocorrelation a multiply the variance of a mean of N ≫ 1/(1 − a) samples by
// (1 + a)/(1 − a); for a regressor of angular frequency ω the spectrum at ω takes its place,
// (1 − a²)/(1 − 2 a cos ω + a²).
TEST(RobustCovariance, FollowsCorrelatedNoise) {
  constexpr double kA = 0.6;
  double variance[2] = {0, 0};
  constexpr int kSeeds = 200;
  for (int seed = 0; seed < kSeeds; ++seed) {
    Vector noise = WhiteNoise(seed);
    for (int k = 1; k < kRows; ++k)
      noise[k] = kA * noise[k - 1] + std::sqrt(1 - kA * kA) * noise[k];
    const RobustCovariance robust = RobustCovarianceOf(ScoresOf(noise), Precision());
    for (int i = 0; i < 2; ++i) variance[i] += robust.ratio[i] * robust.ratio[i] / kSeeds;
  }
  for (int i = 0; i < 2; ++i) {
    const double omega = i == 0 ? 0.7 : 0.3;
    const double spectrum = (1 - kA * kA) / (1 - 2 * kA * std::cos(omega) + kA * kA);
    // The choice of the length raises the mean by less than a quarter.
    EXPECT_GT(variance[i], 0.9 * spectrum) << i;
    EXPECT_LT(variance[i], 1.25 * spectrum) << i;
  }
}

TEST(RobustCovariance, IsUnknownForFewWindows) {
  std::vector<WindowScore> windows = ScoresOf(WhiteNoise(1));
  windows.resize(11);
  const RobustCovariance robust = RobustCovarianceOf(windows, Precision());
  EXPECT_EQ(robust.disagreement, 0);
  EXPECT_EQ(robust.ratio.size(), 0);
}

// All information about the first parameter is in one window: its score is 0 by the fit itself,
// which says nothing about the noise.
TEST(RobustCovariance, IsUnknownIfOneWindowHasAllInformation) {
  std::vector<WindowScore> windows = ScoresOf(WhiteNoise(1));
  for (size_t w = 1; w < windows.size(); ++w) {
    windows[w].score.setZero();
    windows[w].information *= 1e-6;
  }
  windows[0].score.setZero();
  EXPECT_EQ(RobustCovarianceOf(windows, Precision()).ratio.size(), 0);
}

TEST(Constancy, FindsNothingInWhiteNoise) {
  for (int seed = 0; seed < 200; ++seed) {
    EXPECT_FALSE(FindInconsistency(ScoresOf(WhiteNoise(seed)), Precision(), kFlat, 1)) << seed;
  }
}

TEST(Constancy, NamesTheParameterThatChangesAndWhen) {
  for (int changing = 0; changing < 2; ++changing) {
    Vector error = WhiteNoise(3);
    constexpr int kFrom = 24 * kRowsOfWindow;
    constexpr double kStep = 1;
    for (int k = kFrom; k < kRows; ++k) error[k] += kStep * Regressor(k)[changing];
    const std::optional<Inconsistency> found =
        FindInconsistency(ScoresOf(error), Precision(), kFlat, 1);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->parameter, changing);
    EXPECT_LT(found->first.span.end_s, 24);
    EXPECT_GE(found->second.span.start_s, 24);
    // The two windows that differ most are not a fair sample: a margin of four deviations.
    const double deviation = std::hypot(found->first.std_dev, found->second.std_dev);
    EXPECT_NEAR(found->second.change - found->first.change, kStep, 4 * deviation);
    EXPECT_NEAR(found->separation * deviation, std::abs(found->second.change - found->first.change),
                1e-12);
  }
}

// Noise of twice the size assumed is no change of a parameter.
TEST(Constancy, DividesByTheDispersion) {
  int alarms = 0;
  for (int seed = 0; seed < 100; ++seed) {
    const std::vector<WindowScore> windows = ScoresOf(2 * WhiteNoise(seed));
    alarms += FindInconsistency(windows, Precision(), kFlat, 1) ? 1 : 0;
    EXPECT_FALSE(FindInconsistency(windows, Precision(), kFlat, 4)) << seed;
  }
  EXPECT_GT(alarms, 90);
}

// A prior far from the data gives every window a score, but the same one.
TEST(Constancy, DoesNotTakeAPriorForAChange) {
  std::vector<WindowScore> windows = ScoresOf(WhiteNoise(5));
  const Vector pull = (Vector(2) << 10 / std::sqrt(kRows), -8 / std::sqrt(kRows)).finished();
  for (WindowScore& window : windows) window.score += window.information * pull;
  const Vector balance = -SumOf(windows).score;
  EXPECT_FALSE(FindInconsistency(windows, Precision(), balance, 1));
  const RobustCovariance robust = RobustCovarianceOf(windows, Precision());
  EXPECT_NEAR(robust.disagreement,
              RobustCovarianceOf(ScoresOf(WhiteNoise(5)), Precision()).disagreement, 1e-6);
}

// An estimate whose second parameter is held on a bound pulls on all windows. The test of the first
// is, by its invariance, that of the free fit.
TEST(Constancy, DoesNotTakeABoundForAChange) {
  const auto hold = [](std::vector<WindowScore>& windows) {
    constexpr double kHeld = 20;  // how far the bound is from the free fit
    const Matrix all = SumOf(windows).information;
    const Vector away = (Vector(2) << -all(0, 1) / all(0, 0) * kHeld, kHeld).finished();
    for (WindowScore& window : windows) window.score += window.information * away;
    ASSERT_NEAR(SumOf(windows).score[0], 0, 1e-9);
  };
  for (int seed = 0; seed < 100; ++seed) {
    std::vector<WindowScore> windows = ScoresOf(WhiteNoise(seed));
    hold(windows);
    EXPECT_FALSE(FindInconsistency(windows, Precision(), kFlat, 1)) << seed;
  }
  Vector error = WhiteNoise(3);
  for (int k = kRows / 2; k < kRows; ++k) error[k] += Regressor(k)[0];
  std::vector<WindowScore> windows = ScoresOf(error);
  const std::optional<Inconsistency> free = FindInconsistency(windows, Precision(), kFlat, 1);
  hold(windows);
  const std::optional<Inconsistency> held = FindInconsistency(windows, Precision(), kFlat, 1);
  ASSERT_TRUE(free && held);
  EXPECT_EQ(held->parameter, free->parameter);
  // Up to the relative weight 10⁻⁶ ÷ 800 of the prior.
  EXPECT_NEAR(held->separation, free->separation, 1e-4 * free->separation);
}

}  // namespace
}  // namespace polyest::internal::window_statistics_test
