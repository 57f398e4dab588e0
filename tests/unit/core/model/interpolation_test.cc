// Tests the curves through the knots of a sampled signal.

#include "core/model/interpolation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "core/common/check.h"
#include "core/model/input_signal.h"

namespace polyest::internal {
namespace {

double Cubic(double t) { return 1 + t * (-2 + t * (0.5 + 0.25 * t)); }
double CubicSlope(double t) { return -2 + t * (1 + 0.75 * t); }

const std::vector<double> kUneven = {0, 0.3, 1.1, 1.2, 2.5, 2.9, 4, 4.05, 6};

std::vector<double> ValuesOf(double (*function)(double), const std::vector<double>& time_s) {
  std::vector<double> values;
  for (const double t : time_s) values.push_back(function(t));
  return values;
}

TEST(SplineSlope, IsExactOnCubicsAtUnevenKnots) {
  for (const size_t knots : {size_t{4}, size_t{5}, kUneven.size()}) {
    const std::vector<double> time_s(kUneven.begin(),
                                     kUneven.begin() + static_cast<std::ptrdiff_t>(knots));
    const std::vector<double> value = ValuesOf(Cubic, time_s);
    for (size_t k = 0; k < knots; ++k) {
      EXPECT_NEAR(SplineSlope(time_s, value, k), CubicSlope(time_s[k]), 1e-11) << knots << " " << k;
    }
  }
}

TEST(SplineSlope, OfFewKnotsIsThatOfTheParabolaTheLineAndTheConstant) {
  const std::vector<double> t = {0, 1, 3};
  const std::vector<double> parabola = {2, 3, 11};  // follows 2 + t²
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(SplineSlope(t, parabola, k), 2 * t[k], 1e-14);
  EXPECT_EQ(SplineSlope(std::span(t).first(2), std::span(parabola).first(2), 0), 1);
  EXPECT_EQ(SplineSlope(std::span(t).first(1), std::span(parabola).first(1), 0), 0);
}

TEST(SplineSlope, DependsOnNoKnotBeyondItsReach) {
  std::vector<double> value = ValuesOf(std::sin, kUneven);
  const double before = SplineSlope(kUneven, value, 4);
  value[0] = 100;
  value[8] = -100;
  EXPECT_EQ(SplineSlope(kUneven, value, 4), before);
  value[7] = 1;
  EXPECT_NE(SplineSlope(kUneven, value, 4), before);
}

InputSignal Table(std::vector<double> time_s, std::vector<double> value, Interpolation curve) {
  return *InputSignal::Make(TableInput{std::move(time_s), std::move(value), curve, 1});
}

// Returns the largest error of sin 2πt, sampled n times a second, away from the ends.
double WorstError(int n, Interpolation curve) {
  std::vector<double> time_s, value;
  for (int k = 0; k <= 4 * n; ++k) {
    time_s.push_back(static_cast<double>(k) / n);
    value.push_back(std::sin(2 * M_PI * time_s.back()));
  }
  const InputSignal signal = Table(time_s, value, curve);
  double worst = 0;
  for (double t = 1; t < 3; t += 0.001) {
    worst = std::max(worst, std::abs(signal.Shape(t) - std::sin(2 * M_PI * t)));
  }
  return worst;
}

// The orders of convergence are these: halving the step divides the error by 2⁴ for a curve of
// third degree, by 2² for a straight one and by 2 for steps.
TEST(Interpolation, ConvergesWithItsOrder) {
  EXPECT_NEAR(WorstError(20, Interpolation::kCubic) / WorstError(40, Interpolation::kCubic), 16, 2);
  EXPECT_NEAR(WorstError(20, Interpolation::kLinear) / WorstError(40, Interpolation::kLinear), 4,
              0.2);
  EXPECT_NEAR(WorstError(20, Interpolation::kHold) / WorstError(40, Interpolation::kHold), 2, 0.1);
  EXPECT_LT(WorstError(20, Interpolation::kCubic), WorstError(20, Interpolation::kLinear) / 50);
}

TEST(CubicCurve, IsExactOnCubics) {
  const InputSignal signal = Table(kUneven, ValuesOf(Cubic, kUneven), Interpolation::kCubic);
  for (double t = 0; t <= 6; t += 0.01) EXPECT_NEAR(signal.Shape(t), Cubic(t), 1e-11);
}

TEST(ShapePreservingCurve, StaysBetweenItsKnots) {
  const std::vector<double> value = {0, 0, 1, 1, 1, 5, 5, -3, -3};
  const InputSignal signal = Table(kUneven, value, Interpolation::kShapePreserving);
  const InputSignal cubic = Table(kUneven, value, Interpolation::kCubic);
  bool cubic_overshoots = false;
  for (size_t k = 0; k + 1 < kUneven.size(); ++k) {
    const double low = std::min(value[k], value[k + 1]) - 1e-12;
    const double high = std::max(value[k], value[k + 1]) + 1e-12;
    for (int i = 0; i < 50; ++i) {
      const double t = kUneven[k] + (kUneven[k + 1] - kUneven[k]) * i / 50;
      EXPECT_GE(signal.Shape(t), low);
      EXPECT_LE(signal.Shape(t), high);
      cubic_overshoots = cubic_overshoots || cubic.Shape(t) < low || cubic.Shape(t) > high;
    }
  }
  EXPECT_TRUE(cubic_overshoots);
}

TEST(ShapePreservingCurve, IsExactOnStraightLines) {
  const std::vector<double> t = {0, 1, 3};
  const std::vector<double> line = {1, 3, 7};
  for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(MonotoneSlope(t, line, k), 2, 1e-14);
  EXPECT_EQ(MonotoneSlope(std::span(t).first(1), std::span(line).first(1), 0), 0);
}

class SmoothCurve : public ::testing::TestWithParam<Interpolation> {};
INSTANTIATE_TEST_SUITE_P(Both, SmoothCurve,
                         ::testing::Values(Interpolation::kCubic, Interpolation::kShapePreserving));

TEST_P(SmoothCurve, HasContinuousSlopes) {
  const InputSignal signal = Table(kUneven, ValuesOf(std::sin, kUneven), GetParam());
  const double h = 1e-6;
  for (size_t k = 1; k + 1 < kUneven.size(); ++k) {
    const double t = kUneven[k];
    EXPECT_EQ(signal.Shape(t), std::sin(t));
    const double left = (signal.Shape(t) - signal.Shape(t - h)) / h;
    const double right = (signal.Shape(t + h) - signal.Shape(t)) / h;
    // The slopes differ by h times the second derivatives, which are up to about 20 (between knots
    // 0.05 apart).
    EXPECT_NEAR(left, right, 1e-4);
  }
}

TEST_P(SmoothCurve, BreaksOnlyAtItsEnds) {
  const InputSignal signal = Table(kUneven, ValuesOf(std::sin, kUneven), GetParam());
  EXPECT_EQ(signal.NextBreak(-1), 0);
  EXPECT_EQ(signal.NextBreak(0), 6);
  EXPECT_EQ(signal.NextBreak(6), std::numeric_limits<double>::infinity());
  EXPECT_FALSE(signal.Jumps());
}

TEST_P(SmoothCurve, IsTheSameBitsWhenStreamed) {
  const std::vector<double> value = ValuesOf(std::sin, kUneven);
  const InputSignal table = Table(kUneven, value, GetParam());
  InputSignal streamed = *InputSignal::Make(StreamedInput{GetParam(), 1});
  const auto ahead = static_cast<size_t>(streamed.knots_ahead());
  EXPECT_GT(ahead, 0u);
  for (size_t k = 0; k < kUneven.size(); ++k) {
    streamed.Append(kUneven[k], value[k]);
    if (k < ahead) continue;
    // The curve is settled up to knot k − ahead, whatever follows.
    const double t = kUneven[k - ahead] - 0.01;
    EXPECT_EQ(streamed.Shape(t), table.Shape(t));
  }
  streamed.Finish();
  for (double t = -1; t < 7; t += 0.01) EXPECT_EQ(streamed.Shape(t), table.Shape(t));
}

TEST(SmoothCurveCheck, IsNotReadBeforeItIsSettled) {
  InputSignal streamed = *InputSignal::Make(StreamedInput{});
  for (int k = 0; k < 5; ++k) streamed.Append(k, k);
  EXPECT_EQ(streamed.Shape(1), 1);
  EXPECT_THROW(streamed.Shape(2.5), CheckFailure);
}

}  // namespace
}  // namespace polyest::internal
