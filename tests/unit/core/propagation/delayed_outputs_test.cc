// Tests outputs that sensors show late. The oracle is the undamped oscillator, x = x₀ cos ωt.

#include "core/propagation/delayed_outputs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/unit/core/propagation/ensemble.h"

namespace polyest::internal {
namespace {

constexpr double kOmegaOfSwing = 2 * std::numbers::pi;  // 1 Hz

// Swings freely from x₀ = 1, 2, … without error of integration, so that only interpolation errs.
struct Swing : Ensemble {
  explicit Swing(const std::vector<double>& delays_s, bool streamed = false)
      : Ensemble("mass_spring_damper", static_cast<int>(delays_s.size()), {"x", "v"}) {
    Set("m", 1);
    Set("c", 0);
    Set("k", kOmegaOfSwing * kOmegaOfSwing);
    specification.output_delays_s.setZero(points(), 2);
    for (int q = 0; q < points(); ++q) {
      Set("x0", q, q + 1);
      specification.output_delays_s(q, 0) = delays_s[static_cast<size_t>(q)];
    }
    if (!streamed) return;
    Drive("force", StreamedInput{.interpolation = Interpolation::kLinear}, 1);
    for (int k = 0; k <= 1000; ++k) inputs[0].Append(0.01 * k, 0);
  }

  double X(int q, double t) const { return (q + 1) * std::cos(kOmegaOfSwing * t); }
  double V(int q, double t) const { return -(q + 1) * kOmegaOfSwing * std::sin(kOmegaOfSwing * t); }
};

double LargestError(Swing& swing, const std::vector<double>& times_s) {
  EnsemblePropagator propagator(swing.specification, &swing.inputs);
  const Matrix y = swing.Advance(propagator, times_s);
  double largest = 0, largest_of_all = 0, reported = 0;
  for (int q = 0; q < swing.points(); ++q) {
    for (size_t k = 0; k < times_s.size(); ++k) {
      const double at_s = std::max(0.0, times_s[k] - swing.specification.output_delays_s(q, 0));
      const auto column = static_cast<Eigen::Index>(2 * k);
      const double error = std::abs(y(q, column) - swing.X(q, at_s));
      largest = std::max(largest, error / (q + 1));
      EXPECT_NEAR(y(q, column + 1), swing.V(q, times_s[k]), 1e-6 * (q + 1) * kOmegaOfSwing);
      largest_of_all = std::max(largest_of_all, error);
      reported = std::max(reported, propagator.delay_errors()[column]);
    }
  }
  EXPECT_GE(reported + 1e-11, largest_of_all);  // up to rounding
  EXPECT_LE(reported, 1e-5);
  return largest;
}

// The error of interpolation is below the relative tolerance, 1e-7, also where there are only a few
// rows in a period.
TEST(DelayedOutputs, AreThoseOfAnEarlierTime) {
  for (const double step_s : {0.001, 0.05, 0.24}) {
    Swing swing({0, 0.0071, 0.3, step_s});
    EXPECT_LT(LargestError(swing, TimesUntil(3, step_s)), 1e-7) << step_s;
  }
}

TEST(DelayedOutputs, MayBeThoseOfALaterTime) {
  Swing swing({-0.013, 0.02, -0.4});
  EXPECT_LT(LargestError(swing, TimesUntil(2, 0.05)), 1e-7);
}

TEST(DelayedOutputs, NeedNothingAfterTheTimeWhereInputsAreStreamed) {
  Swing swing({0, 1e-5, 0.007, 0.3}, true);
  std::vector<double> times_s;
  // Irregular rows, some of them very close to each other.
  for (int k = 0; k < 200; ++k) times_s.insert(times_s.end(), {0.02 * k, 0.02 * k + 1e-6});
  EXPECT_LT(LargestError(swing, times_s), 1e-7);
}

// The spacing becomes smaller between two nodes.
TEST(DelayedOutputs, FollowRowsThatBecomeCloser) {
  Swing swing({0, 0.001, 0.05}, true);
  std::vector<double> times_s = TimesUntil(1, 0.1);
  for (const double step_s : {1e-2, 1e-3, 1e-4}) {
    for (int k = 0; k < 20; ++k) times_s.push_back(times_s.back() + step_s);
  }
  LargestError(swing, times_s);
}

TEST(DelayedOutputs, DoNotDependOnHowTimesAreDivided) {
  Swing swing({0.004, 0.03, 0.3});
  const std::vector<double> times_s = TimesUntil(2, 0.017);
  const Matrix whole = swing.Propagate(times_s);
  EnsemblePropagator propagator(swing.specification, &swing.inputs);
  for (size_t k = 0; k < times_s.size(); ++k) {
    const Matrix part = swing.Advance(propagator, {times_s[k]});
    EXPECT_EQ(part, whole.middleCols(static_cast<Eigen::Index>(2 * k), 2));
  }
}

// A jump of an output cannot be interpolated; the order of the error is reported.
TEST(DelayedOutputs, ReportTheErrorAtAJump) {
  Ensemble driven("mass_spring_damper", 2, {"a"});
  driven.Set("m", 1);
  driven.Drive("force", StepInput{.amplitude = 1, .time_s = 0.5}, 1);
  driven.specification.output_delays_s.resize(2, 1);
  driven.specification.output_delays_s << 0.011, 0.0137;
  EnsemblePropagator propagator(driven.specification, &driven.inputs);
  const std::vector<double> times_s = TimesUntil(1, 0.01);
  const Matrix a = driven.Advance(propagator, times_s);
  double largest = 0;
  for (size_t k = 0; k < times_s.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    for (int q = 0; q < 2; ++q) {
      const double at_s = times_s[k] - driven.specification.output_delays_s(q, 0);
      if (at_s > 0.5 || at_s < 0) continue;  // the acceleration is 0 until the step
      EXPECT_LE(std::abs(a(q, column)), 4 * propagator.delay_errors()[column] + 1e-11)
          << times_s[k];
      largest = std::max(largest, propagator.delay_errors()[column]);
    }
  }
  EXPECT_GT(largest, 0.1);  // of the order of the jump
}

TEST(DelayedOutputs, AreNanFromTheFailureOfTheirPointOn) {
  Swing swing({0.01, 0.02});
  swing.Set("m", 0, std::numeric_limits<double>::quiet_NaN());
  const Matrix x = swing.Propagate({0.5, 1});
  EXPECT_TRUE(std::isnan(x(0, 0)) && std::isnan(x(0, 2)));
  EXPECT_NEAR(x(1, 2), swing.X(1, 0.98), 1e-6);
  ASSERT_EQ(swing.failures.size(), 1u);
}

}  // namespace
}  // namespace polyest::internal
