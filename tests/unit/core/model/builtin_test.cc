// Tests the equations of the built-in models at a single point (Real = double).

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>

#include "core/model/builtin/duffing.h"
#include "core/model/builtin/linear_two_state.h"
#include "core/model/builtin/mass_spring_damper.h"
#include "core/model/builtin/mass_spring_frequency.h"
#include "core/model/builtin/pendulum.h"
#include "core/model/builtin/roll_plane_2dof.h"

namespace polyest::internal::builtin {
namespace {

template <class Equations>
using States = std::array<double, Equations::kStates>;
template <class Equations>
using Parameters = std::array<double, Equations::kParameters>;
template <class Equations>
using Inputs = std::array<double, Equations::kInputs>;

template <class Equations>
States<Equations> Initial(const Parameters<Equations>& parameters) {
  States<Equations> states;
  Equations::Initial(parameters, states);
  return states;
}

template <class Equations>
States<Equations> Derivatives(const States<Equations>& states,
                              const Parameters<Equations>& parameters,
                              const Inputs<Equations>& inputs = {}) {
  States<Equations> derivatives;
  Equations::Derivatives(0.0, states, parameters, inputs, derivatives);
  return derivatives;
}

template <class Equations>
std::array<double, Equations::kOutputs> Outputs(const States<Equations>& states,
                                                const Parameters<Equations>& parameters,
                                                const Inputs<Equations>& inputs = {}) {
  std::array<double, Equations::kOutputs> outputs;
  Equations::Outputs(0.0, states, parameters, inputs, outputs);
  return outputs;
}

template <class Equations>
Parameters<Equations> Defaults() {
  Parameters<Equations> parameters;
  const ModelDescription description = Equations::Describe();
  for (size_t i = 0; i < parameters.size(); ++i) {
    parameters[i] = description.parameters[i].default_value;
  }
  return parameters;
}

// Returns the rounding error of a few dozen operations on terms of the size `scale`. The energy
// identities below hold exactly except for it.
double Rounding(double scale) { return 1e-14 * scale; }

TEST(MassSpringDamper, StartsAtItsInitialStates) {
  EXPECT_EQ((Initial<MassSpringDamper>({1, 2, 3, 4, 5})), (std::array<double, 2>{4, 5}));
}

TEST(MassSpringDamper, ObeysNewtonsLaw) {
  // The acceleration for m 2, c 3, k 5 at x 7, v 11 under 100 N is a = (100 − 33 − 35)/2.
  const Parameters<MassSpringDamper> parameters = {2, 3, 5, 0, 0};
  EXPECT_EQ((Derivatives<MassSpringDamper>({7, 11}, parameters, {100})),
            (std::array<double, 2>{11, 16}));
  EXPECT_EQ((Outputs<MassSpringDamper>({7, 11}, parameters, {100})),
            (std::array<double, 3>{7, 11, 16}));
}

TEST(MassSpringDamper, LosesToTheDamperWhatTheForceDoesNotGive) {
  const double m = 0.7, c = 0.3, k = 12.5, x = -0.4, v = 1.3, force = 2.1;
  const auto [dx, dv] = Derivatives<MassSpringDamper>({x, v}, {m, c, k, 0, 0}, {force});
  // The energy changes by d/dt (½ m v² + ½ k x²) = force v − c v².
  EXPECT_NEAR(m * v * dv + k * x * dx, force * v - c * v * v, Rounding(10));
}

TEST(MassSpringFrequency, IsOneHertzByDefault) {
  const auto [omega] = Outputs<MassSpringFrequency>({}, Defaults<MassSpringFrequency>());
  EXPECT_NEAR(omega, 2 * std::numbers::pi, Rounding(2 * std::numbers::pi));
}

TEST(MassSpringFrequency, IsTheRootOfStiffnessOverMass) {
  EXPECT_EQ((Outputs<MassSpringFrequency>({}, {4, 100})), (std::array<double, 1>{5}));
}

TEST(LinearTwoState, HasThePapersDerivatives) {
  // The expected values are (57) at x₁ 1, x₂ 10, θ 100, u₁ 1000, u₂ 10000.
  EXPECT_EQ((Derivatives<LinearTwoState>({1, 10}, {100, 0, 0}, {1000, 10000})),
            (std::array<double, 2>{1108, 10081}));
  EXPECT_EQ((Initial<LinearTwoState>({7, 8, 9})), (std::array<double, 2>{8, 9}));
  EXPECT_EQ((Outputs<LinearTwoState>({3, 5}, {0, 0, 0}, {0, 0})),
            (std::array<double, 3>{3, 5, -2}));
}

TEST(LinearTwoState, HidesThetaInTheDifference) {
  for (const double theta : {-8.0, 0.0, 64.0}) {
    const auto [dx1, dx2] = Derivatives<LinearTwoState>({2, 5}, {theta, 0, 0}, {4, 3});
    // The difference y = x₁ − x₂ satisfies ẏ = −3 y + u₁ − u₂ for every θ.
    EXPECT_EQ(dx1 - dx2, -3 * (2 - 5) + 4 - 3);
  }
}

TEST(RollPlane2Dof, StartsAtItsInitialStates) {
  EXPECT_EQ((Initial<RollPlane2Dof>({1, 2, 3, 4, 5, 6, 7, 8, 9})),
            (std::array<double, 4>{6, 7, 8, 9}));
}

TEST(RollPlane2Dof, BalancesForcesAndMoments) {
  // The values are M 4, I 2, L 4, k1 3, k2 5, and x₁ − u₁ = 2, x₂ − u₂ = −2, so that F₁ = 6, F₂ =
  // −10.
  const auto [dx1, dx2, dv1, dv2] =
      Derivatives<RollPlane2Dof>({3, -1, 0.5, 0.25}, {4, 2, 4, 3, 5, 0, 0, 0, 0}, {1, 1});
  EXPECT_EQ(dx1, 0.5);
  EXPECT_EQ(dx2, 0.25);
  // The sum of forces is M (ẍ₁ + ẍ₂)/2 = −(F₁ + F₂) = 4.
  EXPECT_EQ(4 * (dv1 + dv2) / 2, 4);
  // The moment is I (ẍ₂ − ẍ₁)/L = (L/2) (F₁ − F₂) = 32.
  EXPECT_EQ(2 * (dv2 - dv1) / 4, 32);
}

TEST(RollPlane2Dof, ConservesEnergyOnFixedFeet) {
  const Parameters<RollPlane2Dof> p = {580, 63.3316, 1.524, 19357.2, 15000, 0, 0, 0, 0};
  const auto [M, I, L, k1, k2, x1_0, x2_0, v1_0, v2_0] = p;
  const double x1 = 0.02, x2 = -0.05, v1 = 0.7, v2 = 0.4;
  const auto [dx1, dx2, dv1, dv2] = Derivatives<RollPlane2Dof>({x1, x2, v1, v2}, p, {0, 0});
  // The power is d/dt of ½ M ((v₁ + v₂)/2)² + ½ I ((v₂ − v₁)/L)² + ½ k₁ x₁² + ½ k₂ x₂².
  const double power = M * (v1 + v2) / 2 * (dv1 + dv2) / 2 + I * (v2 - v1) / L * (dv2 - dv1) / L +
                       k1 * x1 * dx1 + k2 * x2 * dx2;
  EXPECT_NEAR(power, 0, Rounding(k1 * std::abs(x1 * v1) + k2 * std::abs(x2 * v2)));
}

TEST(RollPlane2Dof, HeavesAndRollsAtTheFrequenciesOfARigidBar) {
  const Parameters<RollPlane2Dof> p = Defaults<RollPlane2Dof>();
  const double M = p[0], I = p[1], L = p[2], k = p[3];
  // The heave x₁ = x₂ has ω² = 2 k/M. The roll x₁ = −x₂ works on two springs of stiffness k on arms
  // L/2, so that its stiffness is k L²/2 and ω² = k L²/(2 I).
  const auto heave = Derivatives<RollPlane2Dof>({1, 1, 0, 0}, p, {0, 0});
  const auto roll = Derivatives<RollPlane2Dof>({1, -1, 0, 0}, p, {0, 0});
  const double heave_squared = 2 * k / M, roll_squared = k * L * L / (2 * I);
  EXPECT_NEAR(heave[2], -heave_squared, Rounding(heave_squared));
  EXPECT_NEAR(heave[3], -heave_squared, Rounding(heave_squared));
  EXPECT_NEAR(roll[2], -roll_squared, Rounding(roll_squared));
  EXPECT_NEAR(roll[3], roll_squared, Rounding(roll_squared));
}

TEST(RollPlane2Dof, HidesItsInertiaWhenBothSidesMoveAlike) {
  const Parameters<RollPlane2Dof> light = Defaults<RollPlane2Dof>();
  Parameters<RollPlane2Dof> heavy = light;
  heavy[1] *= 10;
  const States<RollPlane2Dof> states = {0.1, 0.1, 1, 1};
  const double heave = 2 * light[3] * 0.2 / light[0];  // 2 k (u − x)/M
  for (const Parameters<RollPlane2Dof>& p : {light, heavy}) {
    const auto derivatives = Derivatives<RollPlane2Dof>(states, p, {0.3, 0.3});
    EXPECT_NEAR(derivatives[2], heave, Rounding(10 * heave));
    EXPECT_NEAR(derivatives[3], heave, Rounding(10 * heave));
  }
  // The inertia counts when the two sides are driven differently: F₁ − F₂ = −0.1 k, and ten times
  // the inertia gives a tenth of the roll.
  const double roll = 0.1 * light[3] * light[2] * light[2] / (2 * light[1]);  // ẍ₁ − ẍ₂
  const auto quick = Derivatives<RollPlane2Dof>(states, light, {0.3, 0.2});
  const auto slow = Derivatives<RollPlane2Dof>(states, heavy, {0.3, 0.2});
  EXPECT_NEAR(quick[2] - quick[3], roll, Rounding(10 * roll));
  EXPECT_NEAR(slow[2] - slow[3], roll / 10, Rounding(10 * roll));
}

TEST(Duffing, HasTheDerivativesOfAPolynomialSpring) {
  // The acceleration for m 2, c 3, k 5, k2 7, k3 11, offset 13 at x 2, v 1 under 106 N is a = (106
  // + 13 − 3 − 10 − 28 − 88)/2.
  const Parameters<Duffing> parameters = {2, 3, 5, 7, 11, 13, 17, 19};
  EXPECT_EQ((Derivatives<Duffing>({2, 1}, parameters, {106})), (std::array<double, 2>{1, -5}));
  EXPECT_EQ((Initial<Duffing>(parameters)), (std::array<double, 2>{17, 19}));
  EXPECT_EQ((Outputs<Duffing>({2, 1}, parameters, {106})), (std::array<double, 2>{2, 1}));
}

TEST(Duffing, RestsWhereTheOffsetBalancesTheSpring) {
  // A linear spring of stiffness 4 under the constant force 6 rests at 1.5.
  EXPECT_EQ((Derivatives<Duffing>({1.5, 0}, {1, 0.1, 4, 0, 0, 6, 0, 0}, {0})),
            (std::array<double, 2>{0, 0}));
}

TEST(Duffing, LosesToTheDamperWhatTheForceDoesNotGive) {
  const double m = 0.8, c = 0.2, k = 1.5, k2 = -0.7, k3 = 2.5, offset = 0.3;
  const double x = -0.9, v = 1.7, force = 0.6;
  const auto [dx, dv] = Derivatives<Duffing>({x, v}, {m, c, k, k2, k3, offset, 0, 0}, {force});
  // The energy changes by d/dt (½ m v² + ½ k x² + ⅓ k2 x³ + ¼ k3 x⁴ − offset x) = force v − c v².
  const double power = m * v * dv + (k * x + k2 * x * x + k3 * x * x * x - offset) * dx;
  EXPECT_NEAR(power, force * v - c * v * v, Rounding(10));
}

TEST(Pendulum, FallsFromTheHorizontalWithGravity) {
  // The values θ = π/2, ω = −2 give ω̇ = −9 + 2·0.5 + 4·0.25.
  const auto [dtheta, domega] =
      Derivatives<Pendulum>({std::numbers::pi / 2, -2}, {9, 0.5, 0.25, 0, 0});
  EXPECT_EQ(dtheta, -2);
  EXPECT_NEAR(domega, -7, Rounding(9));
  EXPECT_EQ((Initial<Pendulum>({1, 2, 3, 4, 5})), (std::array<double, 2>{4, 5}));
  EXPECT_EQ((Outputs<Pendulum>({0.5, -2}, {9, 0, 0, 0, 0})), (std::array<double, 2>{0.5, -2}));
}

TEST(Pendulum, IsSlowedByBothDampingsInEitherDirection) {
  const double g_over_l = 9.81, c = 0.2, c2 = 0.4, theta = 2.5;
  for (const double omega : {1.6, -1.6}) {
    const auto [dtheta, domega] = Derivatives<Pendulum>({theta, omega}, {g_over_l, c, c2, 0, 0});
    // The energy changes by d/dt (½ ω² − (g/ℓ) cos θ) = −c ω² − c2 |ω|³.
    const double power = omega * domega + g_over_l * std::sin(theta) * dtheta;
    EXPECT_NEAR(power, -c * omega * omega - c2 * std::pow(std::abs(omega), 3), Rounding(10));
  }
}

}  // namespace
}  // namespace polyest::internal::builtin
