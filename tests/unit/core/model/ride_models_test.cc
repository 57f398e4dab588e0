// Tests the models of the ride over a road: balances that hold exactly, linear systems obtained by
// differences, and closed forms of vehicle dynamics.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <string>

#include "core/model/builtin/quarter_car.h"
#include "core/model/builtin/roll_plane_4dof.h"
#include "tests/unit/core/model/model_at_a_point.h"

namespace polyest::internal::builtin {
namespace {

using RollPlane = ModelAtAPoint<RollPlane4Dof>;
using Quarter = ModelAtAPoint<QuarterCar>;

// The car is far from rest in every state.
constexpr RollPlane::States kMoving = {0.03, -0.02, 0.01, 0.015, 0.4, -0.7, 0.2, 0.5};

TEST(RollPlane4Dof, StartsAtItsInitialStates) {
  RollPlane car;
  const char* names[] = {"x1_0", "x2_0", "xt1_0", "xt2_0", "v1_0", "v2_0", "vt1_0", "vt2_0"};
  for (int i = 0; i < 8; ++i) car[names[i]] = i + 1;
  EXPECT_THAT(car.InitialStates(), testing::ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
}

// The oracle is the documentation's 1.18, 2.71, 9.01 and 9.08 Hz, to the digits that it gives.
TEST(RollPlane4Dof, HasTheModesOfTheDocumentation) {
  RollPlane car;
  car["c_f"] = 0;
  // The force k3 d³ is below 10⁻⁷ of k d at a step of 10⁻⁴ m.
  const Eigen::VectorXcd eigenvalues = car.Jacobian({}, {0, 0}, 1e-4).eigenvalues();
  std::vector<double> frequencies_hz;
  for (const std::complex<double>& eigenvalue : eigenvalues) {
    EXPECT_NEAR(eigenvalue.real(), 0, 1e-6);  // The modes are undamped.
    if (eigenvalue.imag() > 0) frequencies_hz.push_back(eigenvalue.imag() / (2 * std::numbers::pi));
  }
  EXPECT_THAT(frequencies_hz, testing::UnorderedElementsAre(testing::DoubleNear(1.18, 0.005),
                                                            testing::DoubleNear(2.71, 0.005),
                                                            testing::DoubleNear(9.01, 0.005),
                                                            testing::DoubleNear(9.08, 0.005)));
}

// The energies T and V are the header's, written down again.
TEST(RollPlane4Dof, LosesToFrictionWhatTheRoadDoesNotGive) {
  RollPlane car;
  car["m_a"] = 220;
  car["d"] = 0.4;
  const RollPlane::Inputs road = {0.02, -0.01};
  const auto [x1, x2, xt1, xt2, v1, v2, vt1, vt2] = kMoving;
  const auto [dx1, dx2, dxt1, dxt2, a1, a2, at1, at2] = car.Derivatives(kMoving, road);
  EXPECT_EQ((std::array{dx1, dx2, dxt1, dxt2}), (std::array{v1, v2, vt1, vt2}));
  const double delta = 0.4 / 1.524;
  const double v_a = (1 - delta) * v1 + delta * v2, a_a = (1 - delta) * a1 + delta * a2;
  // The power begins as dT/dt.
  double power = 580 * (v1 + v2) / 2 * (a1 + a2) / 2 +
                 63.3316 * (v2 - v1) * (a2 - a1) / (1.524 * 1.524) + 220 * v_a * a_a +
                 36.26 * (vt1 * at1 + vt2 * at2);
  // The loop adds dV/dt at a standing road to the power, and sums the loss to friction.
  double friction = 0;
  const double travel[] = {x1 - xt1, x2 - xt2}, rate[] = {v1 - vt1, v2 - vt2};
  const double tyre[] = {road[0] - xt1, road[1] - xt2}, wheel[] = {vt1, vt2};
  for (int i = 0; i < 2; ++i) {
    power += (19357.2 * travel[i] + 1e5 * std::pow(travel[i], 3)) * rate[i] -
             96319.76 * tyre[i] * wheel[i];
    friction += 142.14 * std::tanh(10 * rate[i]) * rate[i];
  }
  EXPECT_GT(friction, 100);
  EXPECT_NEAR(power, -friction, Rounding(1e4));
}

TEST(RollPlane4Dof, AnswersASymmetricRoadSymmetrically) {
  RollPlane car;
  car["m_a"] = 150;  // at the centre, the default
  const auto derivatives =
      car.Derivatives({0.03, 0.03, 0.01, 0.01, 0.4, 0.4, -0.2, -0.2}, {0.05, 0.05});
  for (size_t i = 0; i < 8; i += 2) {
    EXPECT_NEAR(derivatives[i], derivatives[i + 1], Rounding(1000)) << i;
  }
}

TEST(RollPlane4Dof, MirroredMovesAsItsMirrorImage) {
  RollPlane car, mirrored;
  car["m_a"] = mirrored["m_a"] = 150;
  car["d"] = 0.3;
  mirrored["d"] = 1.524 - 0.3;
  const auto [x1, x2, xt1, xt2, v1, v2, vt1, vt2] = kMoving;
  const auto here = car.Derivatives(kMoving, {0.05, 0.02});
  const auto there = mirrored.Derivatives({x2, x1, xt2, xt1, v2, v1, vt2, vt1}, {0.02, 0.05});
  for (size_t i = 0; i < 8; i += 2) {
    EXPECT_NEAR(here[i], there[i + 1], Rounding(1000)) << i;
    EXPECT_NEAR(here[i + 1], there[i], Rounding(1000)) << i;
  }
}

TEST(RollPlane4Dof, HeavesWithAMassAtItsCentreLikeAHeavierBar) {
  RollPlane loaded, heavier;
  loaded["m_a"] = 200;
  heavier["M"] = 780;
  const RollPlane::Inputs road = {0.02, -0.01};
  const auto a = loaded.Derivatives(kMoving, road), b = heavier.Derivatives(kMoving, road);
  EXPECT_NEAR(a[4] + a[5], b[4] + b[5], Rounding(1000));
  EXPECT_NEAR(a[5] - a[4], b[5] - b[4], Rounding(1000));  // It also rolls like the other.
}

// The point mass at the end of the bar acts, by Steiner's theorem, as if fixed to that corner.
TEST(RollPlane4Dof, CarriesAMassAtItsEndThereAlone) {
  RollPlane car;
  car["m_a"] = 200;
  car["d"] = 0;
  // The equations are Newton's law for the whole bar and the balance of moments about the centre.
  const auto d = car.Derivatives(kMoving, {0, 0});
  const double travel1 = 0.02, travel2 = -0.035, rate1 = 0.2, rate2 = -1.2;
  const double F1 = 19357.2 * travel1 + 1e5 * std::pow(travel1, 3) + 142.14 * std::tanh(10 * rate1);
  const double F2 = 19357.2 * travel2 + 1e5 * std::pow(travel2, 3) + 142.14 * std::tanh(10 * rate2);
  EXPECT_NEAR(580 * (d[4] + d[5]) / 2 + 200 * d[4], -F1 - F2, Rounding(1e4));
  EXPECT_NEAR(63.3316 * (d[5] - d[4]) / 1.524, 1.524 / 2 * (F1 + 200 * d[4] - F2), Rounding(1e4));
}

TEST(RollPlane4Dof, ReadsTravelAndAccelerations) {
  RollPlane car;
  car["m_a"] = 200;
  car["d"] = 0.5;
  const RollPlane::Inputs road = {0.02, -0.01};
  const auto derivatives = car.Derivatives(kMoving, road);
  EXPECT_EQ(car.Output("d1", kMoving, road), 0.03 - 0.01);
  EXPECT_EQ(car.Output("d2", kMoving, road), -0.02 - 0.015);
  EXPECT_EQ(car.Output("d1_rate", kMoving, road), 0.4 - 0.2);
  EXPECT_EQ(car.Output("d2_rate", kMoving, road), -0.7 - 0.5);
  EXPECT_EQ(car.Output("x1", kMoving, road), 0.03);
  EXPECT_EQ(car.Output("x2", kMoving, road), -0.02);
  EXPECT_EQ(car.Output("xt1", kMoving, road), 0.01);
  EXPECT_EQ(car.Output("xt2", kMoving, road), 0.015);
  EXPECT_EQ(car.Output("a1", kMoving, road), derivatives[4]);
  EXPECT_EQ(car.Output("a2", kMoving, road), derivatives[5]);
}

TEST(QuarterCar, StartsAtItsInitialStates) {
  Quarter car;
  const char* names[] = {"zs_0", "zu_0", "vs_0", "vu_0"};
  for (int i = 0; i < 4; ++i) car[names[i]] = i + 1;
  EXPECT_THAT(car.InitialStates(), testing::ElementsAre(1, 2, 3, 4));
}

// A constant force f on the body presses suspension and tyre together by f/ks + f/kt.
TEST(QuarterCar, RestsWhereSpringsInSeriesCarryALoad) {
  Quarter car;
  const double load = 500, zu = -load / 190000, zs = zu - load / 16800;
  const auto [dzs, dzu, as, au] = car.Derivatives({zs, zu, 0, 0}, {0});
  EXPECT_EQ(dzs, 0);
  EXPECT_EQ(dzu, 0);
  EXPECT_NEAR(290 * as, load, Rounding(load));
  EXPECT_NEAR(59 * au, 0, Rounding(load));
}

TEST(QuarterCar, StandsOnARaisedRoadAsOnALevelOne) {
  Quarter car;
  car["ks3"] = 1e6;
  EXPECT_THAT(car.Derivatives({0.07, 0.07, 0, 0}, {0.07}), testing::Each(0.0));
}

TEST(QuarterCar, LosesToTheDamperWhatTheRoadDoesNotGive) {
  Quarter car;
  car["ks3"] = 1e6;
  const double zs = 0.04, zu = -0.01, vs = -0.3, vu = 0.8, road = 0.02;
  const auto [dzs, dzu, as, au] = car.Derivatives({zs, zu, vs, vu}, {road});
  const double travel = zs - zu, rate = vs - vu;
  const double power = 290 * vs * as + 59 * vu * au +
                       (16800 * travel + 1e6 * std::pow(travel, 3)) * rate -
                       190000 * (road - zu) * vu;
  EXPECT_NEAR(power, -1000 * rate * rate, Rounding(1e4));
  EXPECT_EQ(car.Output("zs_accel", {zs, zu, vs, vu}, {road}), as);
  EXPECT_EQ(car.Output("travel", {zs, zu, vs, vu}, {road}), travel);
  EXPECT_EQ(car.Output("travel_rate", {zs, zu, vs, vu}, {road}), rate);
}

// The oracle is zs/road = kt c/D, zu/road = kt (ms s² + c)/D with D = (ms s² + c)(mu s² + c + kt) −
// c² and c = cs s + ks. The frequencies go from below the body's mode (1.2 Hz) to above the wheel's
// (9.5 Hz).
TEST(QuarterCar, HasTheTransferFunctionsOfItsEquations) {
  Quarter car;
  // The model is linear, so that differences over a step of 1 are exact except for rounding.
  const Matrix A = car.Jacobian({}, {0}, 1);
  const auto unit = car.Derivatives({}, {1});
  const Eigen::VectorXcd b = Eigen::Map<const Vector>(unit.data(), 4).cast<std::complex<double>>();
  for (const double hz : {0.1, 1.2, 3.0, 9.5, 40.0}) {
    const std::complex<double> s(0, 2 * std::numbers::pi * hz);
    const Eigen::MatrixXcd resolvent = s * Eigen::MatrixXcd::Identity(4, 4) - A;
    const Eigen::VectorXcd response = resolvent.partialPivLu().solve(b);
    const std::complex<double> c = 1000.0 * s + 16800.0;
    const std::complex<double> D = (290.0 * s * s + c) * (59.0 * s * s + c + 190000.0) - c * c;
    const std::complex<double> body = 190000.0 * c / D;
    const std::complex<double> wheel = 190000.0 * (290.0 * s * s + c) / D;
    // The bound is the condition number of the resolvent, about 10⁶, times a rounding.
    EXPECT_LT(std::abs(response(0) - body), 1e-9 * std::abs(body)) << hz;
    EXPECT_LT(std::abs(response(1) - wheel), 1e-9 * std::abs(wheel)) << hz;
  }
}

}  // namespace
}  // namespace polyest::internal::builtin
