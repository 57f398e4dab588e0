// Tests the bicycle model against closed forms of vehicle dynamics.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <complex>
#include <limits>

#include "core/model/builtin/bicycle.h"
#include "core/model/lane_model.h"
#include "tests/unit/core/model/model_at_a_point.h"

namespace polyest::internal::builtin {
namespace {

using SingleTrack = ModelAtAPoint<Bicycle>;

TEST(Bicycle, StartsAtItsInitialStates) {
  SingleTrack car;
  car["vy_0"] = 2;
  car["r_0"] = 3;
  EXPECT_THAT(car.InitialStates(), testing::ElementsAre(2, 3));
}

// Returns the equilibrium of a steady turn, by Newton's method from straight ahead.
SingleTrack::States SteadyTurn(const SingleTrack& car, double vx, double delta) {
  SingleTrack::States states = {0, 0};
  for (int i = 0; i < 20; ++i) {
    const auto rates = car.Derivatives(states, {vx, delta});
    const Vector step = car.Jacobian(states, {vx, delta}, 1e-6)
                            .partialPivLu()
                            .solve(Eigen::Map<const Vector>(rates.data(), 2));
    for (size_t j = 0; j < 2; ++j) states[j] -= step(static_cast<Eigen::Index>(j));
  }
  return states;
}

// The oracle is r/δ = vx/(L + K vx²), K = m/L (lr/Cf − lf/Cr). The approximation of small angles
// leaves out terms of the order δ².
TEST(Bicycle, TurnsWithTheClassicalYawGain) {
  SingleTrack car;
  const double K = 1500 / 2.6 * (1.4 / 80000 - 1.2 / 90000), delta = 1e-4;
  EXPECT_GT(K, 0);  // The car understeers.
  for (const double vx : {1.0, 10.0, 30.0, 60.0}) {
    const auto [vy, r] = SteadyTurn(car, vx, delta);
    EXPECT_NEAR(r / delta, vx / (2.6 + K * vx * vx), 1e-6 * vx) << vx;
    // A steady turn has v̇y = 0, so that ay = vx r.
    EXPECT_NEAR(car.Output("ay", {vy, r}, {vx, delta}), vx * r, 1e-9 * vx);
    EXPECT_EQ(car.Output("beta", {vy, r}, {vx, delta}), std::atan2(vy, vx));
  }
  // The gain is largest at the characteristic speed √(L/K), where it is half the neutral car's.
  const double characteristic = std::sqrt(2.6 / K);
  const auto gain = [&](double vx) { return SteadyTurn(car, vx, delta)[1] / delta; };
  EXPECT_NEAR(gain(characteristic), characteristic / 2.6 / 2, 1e-5);
  EXPECT_LT(gain(0.95 * characteristic), gain(characteristic));
  EXPECT_LT(gain(1.05 * characteristic), gain(characteristic));
}

TEST(Bicycle, TurnsAsItsWheelsPointWhenNeutral) {
  SingleTrack car;
  car["Cr"] = 80000 * 1.2 / 1.4;  // lf Cf = lr Cr, so K = 0
  for (const double vx : {5.0, 50.0}) {
    EXPECT_NEAR(SteadyTurn(car, vx, 1e-4)[1] / 1e-4, vx / 2.6, 1e-6 * vx) << vx;
  }
}

TEST(Bicycle, LosesItsStabilityAtTheCriticalSpeedWhenOversteering) {
  SingleTrack car;
  car["Cr"] = 60000;
  const double K = 1500 / 2.6 * (1.4 / 80000 - 1.2 / 60000);
  ASSERT_LT(K, 0);
  const double critical = std::sqrt(-2.6 / K);
  const auto growth = [&](double vx) {
    return car.Jacobian({0, 0}, {vx, 0}, 1e-5).eigenvalues().real().maxCoeff();
  };
  EXPECT_LT(growth(0.99 * critical), 0);
  EXPECT_GT(growth(1.01 * critical), 0);
}

TEST(Bicycle, GoesStraightAheadUnsteered) {
  EXPECT_THAT(SingleTrack().Derivatives({0, 0}, {20, 0}), testing::Each(0.0));
}

// The oracle is the laws of Newton and Euler at angles that are not small.
TEST(Bicycle, ResolvesTheFrontForceAlongTheSteeredWheel) {
  SingleTrack car;
  const double vx = 5, delta = 0.6, vy = 1.5, r = 0.8;
  const double front = 80000 * (delta - std::atan((vy + 1.2 * r) / vx));
  const double rear = -90000 * std::atan((vy - 1.4 * r) / vx);
  const auto [dvy, dr] = car.Derivatives({vy, r}, {vx, delta});
  EXPECT_NEAR(1500 * (dvy + vx * r), front * std::cos(delta) + rear, Rounding(1e5));
  EXPECT_NEAR(2500 * dr, 1.2 * front * std::cos(delta) - 1.4 * rear, Rounding(1e5));
}

TEST(Bicycle, IsExactlyLinearWithoutAFrictionLimit) {
  SingleTrack unlimited, limited;
  limited["mu"] = 1e9;
  const SingleTrack::States states = {1.5, 0.8};
  const auto a = unlimited.Derivatives(states, {5, 0.6}), b = limited.Derivatives(states, {5, 0.6});
  EXPECT_EQ(a, b);  // (C α/(10⁹ Fz))² is below a rounding of 1.
  EXPECT_TRUE(std::isfinite(a[0]) && std::isfinite(a[1]));
}

TEST(Bicycle, NeverPassesItsFrictionLimit) {
  SingleTrack car;
  car["mu"] = 0.8;
  for (const double vy : {-50.0, -3.0, -0.1, 0.0, 0.1, 3.0, 50.0}) {
    EXPECT_LT(std::abs(car.Output("ay", {vy, 0}, {1, 0})), 0.8 * kGravity) << vy;
  }
  // The car slides sideways almost at the limit: C α/(mu Fz) is about 19 at α = π/2, and 1 − 1/√(1
  // + 19⁻²) = 0.0014.
  EXPECT_NEAR(car.Output("ay", {-1e6, 0}, {1, 0}), 0.8 * kGravity, 0.002 * 0.8 * kGravity);
}

TEST(Bicycle, StartsToSlideWithTheTyresStiffness) {
  SingleTrack grippy, linear;
  grippy["mu"] = 0.8;
  const SingleTrack::States states = {1e-4, 0};
  const double a = grippy.Derivatives(states, {20, 0})[0],
               b = linear.Derivatives(states, {20, 0})[0];
  // The relative difference is ½ (C α/(mu Fz))² = ½ (0.4/6337)² = 2·10⁻⁹.
  EXPECT_NEAR(a / b, 1, 1e-8);
  EXPECT_LT(std::abs(a), std::abs(b));
}

TEST(Bicycle, SaysNothingWhenItDoesNotRollForwards) {
  SingleTrack car;
  for (const double vx : {0.0, -0.0, -10.0, std::numeric_limits<double>::quiet_NaN()}) {
    for (const double vy : {0.0, 1.0}) {
      EXPECT_THAT(car.Derivatives({vy, 0.1}, {vx, 0.1}), testing::Each(testing::IsNan())) << vx;
      EXPECT_TRUE(std::isnan(car.Output("ay", {vy, 0.1}, {vx, 0.1}))) << vx;
      EXPECT_TRUE(std::isnan(car.Output("beta", {vy, 0.1}, {vx, 0.1}))) << vx;
    }
  }
}

TEST(Lanes, AreNanAloneWhereTheSpeedIsNotPositive) {
  const LaneModel<Bicycle> model;
  Eigen::ArrayXXd parameters(kLanes, 9), inputs(kLanes, 2), rates(kLanes, 2);
  for (int i = 0; i < 9; ++i) {
    parameters.col(i).setConstant(model.description().parameters[i].default_value);
  }
  inputs.col(0).setConstant(20);
  inputs.col(1).setConstant(0.01);
  inputs(3, 0) = 0;
  model.Derivatives(0, Eigen::ArrayXXd::Zero(kLanes, 2), parameters, inputs, rates);
  for (int i = 0; i < kLanes; ++i) EXPECT_EQ(rates.row(i).isFinite().all(), i != 3) << i;
}

// The oracle is 1 − 2/(e^{2x} + 1), to a few roundings of 1.
TEST(Lanes, HaveAHyperbolicTangent) {
  const Lane x = {-1e300, -19.0, -0.5, 0.0, 1e-9, 0.3, 21.0, 1e300};
  const Lane tangent = Tanh(x);
  for (int i = 0; i < kLanes; ++i) EXPECT_NEAR(tangent[i], std::tanh(x[i]), 5e-16) << x[i];
  EXPECT_EQ(tangent[3], 0);  // There is no friction at all at rest.
}

}  // namespace
}  // namespace polyest::internal::builtin
