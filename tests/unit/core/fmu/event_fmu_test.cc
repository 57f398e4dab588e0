// Compares events of Model Exchange with closed forms.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/core/fmu/fmu_ensemble.h"

namespace polyest::internal {
namespace {

constexpr double kG = 9.81;

// Returns the height of a ball that is let go at h0 and keeps the part e of its speed at each
// impact.
double BallHeight(double h0, double e, double time_s) {
  const double fall_s = std::sqrt(2 * h0 / kG);
  if (time_s < fall_s) return h0 - kG * time_s * time_s / 2;
  double speed = e * kG * fall_s;
  double start_s = fall_s;
  while (time_s >= start_s + 2 * speed / kG) {
    start_s += 2 * speed / kG;
    speed *= e;
  }
  const double flight_s = time_s - start_s;
  return speed * flight_s - kG * flight_s * flight_s / 2;
}

class Ball : public testing::TestWithParam<const char*> {};

TEST_P(Ball, BouncesAsTheClosedFormSays) {
  FmuEnsemble ensemble(GetParam(), 3, {"h"});
  const std::vector<double> restitutions = {0.6, 0.7, 0.8};
  for (int point = 0; point < 3; ++point) {
    ensemble.Set("e", point, restitutions[static_cast<size_t>(point)]);
    ensemble.Set("h0", point, 1 + point);
  }
  const std::vector<double> times_s = TimesUntil(1.5, 0.05);
  const Matrix heights = ensemble.Propagate(times_s);
  EXPECT_THAT(ensemble.failures, testing::IsEmpty());
  for (int point = 0; point < 3; ++point) {
    for (size_t k = 0; k < times_s.size(); ++k) {
      const double e = restitutions[static_cast<size_t>(point)];
      // A parabola is integrated exactly, except for the low orders with which a start begins. Some
      // dozens of local errors of at most 1e-7 remain, of heights up to 3 m and speeds up to 8 m/s
      // over 1.5 s.
      EXPECT_NEAR(heights(point, static_cast<Eigen::Index>(k)),
                  BallHeight(1 + point, e, times_s[k]), 50 * 8e-7)
          << "point " << point << " at " << times_s[k];
    }
  }
}

TEST_P(Ball, ComesToRest) {
  FmuEnsemble ensemble(GetParam(), 1, {"h", "v"});
  const Matrix outputs = ensemble.Propagate({5});
  EXPECT_EQ(outputs(0, 0), 0);
  EXPECT_EQ(outputs(0, 1), 0);
}

TEST_P(Ball, ThatNeverRestsFailsWhereItsEventsAccumulate) {
  FmuEnsemble ensemble(GetParam(), 2, {"h"});
  ensemble.Set("rest_speed", 0, 0);
  const Matrix heights = ensemble.Propagate({1, 5});
  ASSERT_THAT(ensemble.failures, testing::SizeIs(1));
  EXPECT_EQ(ensemble.failures[0].point, 0);
  EXPECT_THAT(ensemble.failures[0].reason, testing::HasSubstr("accumulate"));
  // All bounces together take t_1 (1 + e)/(1 − e). Bounces lower than the local errors of some ten
  // steps, 1e-7 of the first height each, are lost in these errors. The lost bounces begin at v =
  // √(2 g 1e-6 m) and would take 2 v/(g (1 − e)) together.
  const double end_s = std::sqrt(2 / kG) * 1.7 / 0.3;
  EXPECT_NEAR(ensemble.failures[0].time_s, end_s, 2 * std::sqrt(2 * kG * 1e-6) / (kG * 0.3));
  EXPECT_TRUE(std::isfinite(heights(0, 0)));
  EXPECT_TRUE(std::isnan(heights(0, 1)));
  EXPECT_EQ(heights(1, 1), 0);
}

TEST_P(Ball, DoesNotDependOnTheNumberOfWorkers) {
  FmuEnsemble one(GetParam(), 70, {"h"});
  for (int point = 0; point < 70; ++point) one.Set("h0", point, 1 + 0.01 * point);
  FmuEnsemble two = one;
  two.specification.threads = 2;
  EXPECT_EQ(one.Propagate({0.5, 1}), two.Propagate({0.5, 1}));
}

INSTANTIATE_TEST_SUITE_P(Versions, Ball, testing::Values("ball_me2", "ball_me3"));

class Switch : public testing::TestWithParam<const char*> {};

TEST_P(Switch, TurnsAtTheTimesThatTheFmuNames) {
  FmuEnsemble ensemble(GetParam(), 2, {"x"});
  ensemble.Set("period", 0, 0.3);
  ensemble.Set("period", 1, 0.25);
  const std::vector<double> times_s = TimesUntil(2, 0.05);
  const Matrix x = ensemble.Propagate(times_s);
  for (int point = 0; point < 2; ++point) {
    const double period_s = point == 0 ? 0.3 : 0.25;
    for (size_t k = 0; k < times_s.size(); ++k) {
      // The output is a triangle: up for one period, down for the next.
      const double phase_s = std::remainder(times_s[k], 2 * period_s);
      // A straight line is exact for every method; the sums of times carry rounding errors.
      EXPECT_NEAR(x(point, static_cast<Eigen::Index>(k)), std::abs(phase_s), 1e-12);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Versions, Switch, testing::Values("switch_me2", "switch_me3"));

}  // namespace
}  // namespace polyest::internal
