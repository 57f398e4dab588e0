// Tests the parts of an interval over which process noise is added. The oracle is the variance that
// white noise leaves in a mode ẋ = −λ x after the time T, (1 − e^{−2λT})/(2λ).

#include "core/propagation/noise_parts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace polyest::internal {
namespace {

constexpr double kStart_s = 3;

// Returns the variance by Simpson's rule over the parts.
double SimpsonsVariance(const std::vector<double>& ends_s, double lambda) {
  double from_s = kStart_s, variance = 0;
  for (const double to_s : ends_s) {
    const auto left = [&](double s) { return std::exp(-2 * lambda * (ends_s.back() - s)); };
    variance += (to_s - from_s) / 6 * (left(from_s) + 4 * left((from_s + to_s) / 2) + left(to_s));
    from_s = to_s;
  }
  return variance;
}

TEST(NoiseParts, LeaveTheVarianceOfFastAndSlowModes) {
  std::vector<double> ends_s;
  for (const double interval_s : {0.1, 1.0, 16.5, 1e3, 1e6}) {
    DivideForNoise(kStart_s, kStart_s + interval_s, 1, ends_s);
    ASSERT_EQ(ends_s.back(), kStart_s + interval_s);
    for (const double lambda : {1.0, 0.3, 0.01, 1e-5}) {
      const double exact = -std::expm1(-2 * lambda * interval_s) / (2 * lambda);
      // The relative error of Simpson's rule over a part is (2λh)⁴/2880 with λh ≤ 1.
      EXPECT_NEAR(SimpsonsVariance(ends_s, lambda), exact, 0.01 * exact)
          << interval_s << " s, " << lambda << "/s";
    }
  }
}

TEST(NoiseParts, AreEvenWhereFewAreEnough) {
  std::vector<double> ends_s;
  DivideForNoise(0, 2, 2, ends_s);
  EXPECT_EQ(ends_s, (std::vector<double>{0.5, 1, 1.5, 2}));
  DivideForNoise(0, 2, 0, ends_s);
  EXPECT_EQ(ends_s, std::vector<double>{2});
}

TEST(NoiseParts, AreFewAndIncreaseForAnyRate) {
  std::vector<double> ends_s;
  for (const double rate : {1e12, 1e300, std::numeric_limits<double>::infinity(), std::nan("")}) {
    DivideForNoise(1'000, 1'001, rate, ends_s);
    EXPECT_LT(ends_s.size(), 500u);
    double before_s = 1'000;
    for (const double end_s : ends_s) {
      EXPECT_GT(end_s, before_s);
      before_s = end_s;
    }
    EXPECT_EQ(ends_s.back(), 1'001);
  }
}

}  // namespace
}  // namespace polyest::internal
