#include "core/propagation/crossing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace polyest::internal {
namespace {

template <class Function>
StepSamples Sampled(const Function& function) {
  return {function(0.0), function(0.25), function(0.5), function(0.75), function(1.0)};
}

TEST(FirstCrossing, IsTheFirstRootAtWhichThePolynomialBecomesPositive) {
  // The roots are 0.3 and 0.9, and 0.6, where the polynomial becomes negative again.
  const auto cubic = [](double s) { return (s - 0.3) * (s - 0.6) * (s - 0.9); };
  const Crossing crossing = FirstCrossing(Sampled(cubic), false);
  ASSERT_TRUE(crossing.found);
  EXPECT_NEAR(crossing.theta, 0.3, 1e-12);
  EXPECT_NEAR(crossing.slope, 0.18, 1e-5);  // (0.3 − 0.6)(0.3 − 0.9)
  const Crossing falling = FirstCrossing(Sampled([&](double s) { return -cubic(s + 0.3); }), false);
  ASSERT_TRUE(falling.found);
  EXPECT_NEAR(falling.theta, 0.3, 1e-12);
}

TEST(FirstCrossing, IsFoundHoweverSoonTheFunctionCrossesBack) {
  for (const double width : {0.2, 1e-2, 1e-4}) {
    // Positive only within width/2 of 0.6180.
    const double middle = 0.6180;
    const auto parabola = [&](double s) { return width * width / 4 - (s - middle) * (s - middle); };
    const Crossing crossing = FirstCrossing(Sampled(parabola), false);
    ASSERT_TRUE(crossing.found) << width;
    EXPECT_NEAR(crossing.theta, middle - width / 2, 1e-10 / width);
  }
  const Crossing none =
      FirstCrossing(Sampled([](double s) { return -1e-8 - (s - 0.618) * (s - 0.618); }), false);
  EXPECT_FALSE(none.found);
}

TEST(FirstCrossing, DoesNotTakeTheStartOnTheSurfaceForOne) {
  const auto leaving = [](double s) { return -s * (1 - s / 2); };
  const auto returning = [](double s) { return s * (s - 0.7); };
  const auto touching = [](double s) { return -s * s; };
  for (const double error : {-1e-17, 0.0, 1e-17}) {
    const auto with_error = [error](const auto& function) {
      StepSamples samples = Sampled(function);
      samples[0] = error;
      return samples;
    };
    EXPECT_FALSE(FirstCrossing(with_error(leaving), true).found);
    EXPECT_FALSE(FirstCrossing(with_error(touching), true).found);
    const Crossing crossing = FirstCrossing(with_error(returning), true);
    ASSERT_TRUE(crossing.found);
    EXPECT_NEAR(crossing.theta, 0.7, 1e-12);
    const Crossing wrong_way =
        FirstCrossing(with_error([&](double s) { return -leaving(s); }), true);
    ASSERT_TRUE(wrong_way.found);
    EXPECT_EQ(wrong_way.theta, 0);
  }
}

// The polynomial's inner coefficients are 0, but for rounding of either sign.
TEST(FirstCrossing, IsNotMadeByRoundingWhereTheFunctionFallsAsAHighPower) {
  for (const int power : {2, 3, 4}) {
    for (double size = 0.1; size < 10; size *= 1.07) {
      const auto falling = [&](double s) { return -std::pow(size * s, power) / 3; };
      EXPECT_FALSE(FirstCrossing(Sampled(falling), false).found) << power << " " << size;
      EXPECT_FALSE(FirstCrossing(Sampled(falling), true).found) << power << " " << size;
    }
  }
}

TEST(FirstCrossing, IsAtASampleWhereSomeAreNotFinite) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  constexpr double kInf = std::numeric_limits<double>::infinity();
  const Crossing crossing = FirstCrossing({kNan, -kInf, 1, kInf, kInf}, false);
  EXPECT_TRUE(crossing.found);
  EXPECT_EQ(crossing.theta, 0.5);
  EXPECT_TRUE(std::isfinite(crossing.slope));
  EXPECT_EQ(FirstCrossing({kInf, kInf, 1, 1, 1}, true).theta, 0.25);
  EXPECT_FALSE(FirstCrossing({kNan, kNan, kNan, kNan, -1}, false).found);
}

TEST(Interpolate, IsExactForDegreeFour) {
  const auto quartic = [](double s) { return 3 + s * (2 - s * (5 - s * (1 + 4 * s))); };
  for (const double s : {0.0, 0.1, 0.875, 1.0}) {
    EXPECT_NEAR(Interpolate(Sampled(quartic), s), quartic(s), 1e-14);
  }
}

}  // namespace
}  // namespace polyest::internal
