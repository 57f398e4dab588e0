#pragma once

// Lateral dynamics of a vehicle as a single-track model: the wheels of each axle are merged into
// one on the centre line. The vehicle has the mass m and the yaw inertia Iz about the centre of
// mass, which is lf behind the front axle and lr ahead of the rear axle. The inputs are the speed
// vx along the vehicle and the steering angle delta of the front wheel. The states are the lateral
// velocity vy of the centre of mass and the yaw rate r, both positive to the left. Newton's and
// Euler's laws in axes fixed to the vehicle are
//
//   m (v̇y + vx r) = Ff cos δ + Fr,   Iz ṙ = lf Ff cos δ − lr Fr.
//
// The axles move sideways with vy + lf r and vy − lr r. Their slip angles are therefore
//
//   αf = δ − atan2(vy + lf r, vx),   αr = −atan2(vy − lr r, vx).
//
// The slip angles and cos δ are not approximated for small angles: atan2 and cos δ cost little,
// keep the equations right at large steering angles (parking), and keep the slip angles bounded in
// a spin. Linearized, they are the usual small-angle equations. The tyre force of an axle is C α,
// bounded by friction when mu is given:
//
//   F = C α/√(1 + (C α/(mu Fz))²),   |F| < mu Fz,   Fz = m g lr/L in front, m g lf/L at the rear,
//
// with the static axle loads, L = lf + lr and g = 9.81 m/s². The default mu = ∞ is exactly F = C α:
// C α/∞ is 0. In a steady turn at small angles the yaw gain is, with the understeer gradient K,
//
//   r/δ = vx/(L + K vx²),   K = m/L (lr/Cf − lf/Cr).
//
// The model is valid for vx > 0. At vx ≤ 0 no slip angle exists: the derivatives and outputs are
// NaN, and the trajectory is a failed point. (As vx approaches 0 from above, the equations grow
// stiff like 1/vx.) The model has no load transfer, no relaxation length and no roll, and drive and
// brake forces do not reduce the tyres' grip. The parameters m, Iz, lf, lr, Cf, Cr and mu must be
// above 0.

#include <array>
#include <cmath>
#include <limits>

#include "core/model/lane.h"
#include "core/model/vector_functions.h"
#include "polyest/model.h"

namespace polyest::internal::builtin {

struct Bicycle {
  static constexpr int kStates = 2;
  static constexpr int kParameters = 9;
  static constexpr int kInputs = 2;
  static constexpr int kOutputs = 4;
  static constexpr bool kUsesTime = false;

  static ModelDescription Describe() {
    return {
        .name = "bicycle",
        .summary = "Lateral velocity and yaw rate of a vehicle that is steered at a given speed",
        .equations =
            "m (vy' + vx r) = Ff cos(delta) + Fr;  Iz r' = lf Ff cos(delta) - lr Fr;  "
            "Ff = T(Cf af, m g lr/(lf+lr)), af = delta - atan2(vy + lf r, vx);  "
            "Fr = T(Cr ar, m g lf/(lf+lr)), ar = -atan2(vy - lr r, vx);  "
            "T(F, Fz) = F/sqrt(1 + (F/(mu Fz))^2), g = 9.81 m/s^2;  vx > 0",
        .source =
            "the single-track model: P. Riekert and T. E. Schunck, Zur Fahrmechanik des "
            "gummibereiften Kraftfahrzeugs, Ingenieur-Archiv 11 (1940); friction bound added",
        .states = {{"vy", "m/s", "lateral velocity of the centre of mass, to the left"},
                   {"r", "rad/s", "yaw rate, to the left"}},
        .parameters = {{"m", "kg", "mass", 1500},
                       {"Iz", "kg m^2", "yaw inertia about the centre of mass", 2500},
                       {"lf", "m", "distance of the front axle from the centre of mass", 1.2},
                       {"lr", "m", "distance of the rear axle from the centre of mass", 1.4},
                       {"Cf", "N/rad", "cornering stiffness of the front axle", 80000},
                       {"Cr", "N/rad", "cornering stiffness of the rear axle", 90000},
                       {"mu", "1", "friction coefficient; infinite: linear tyres",
                        std::numeric_limits<double>::infinity()},
                       {"vy_0", "m/s", "initial lateral velocity", 0},
                       {"r_0", "rad/s", "initial yaw rate", 0}},
        .inputs = {{"vx", "m/s", "speed along the vehicle; above 0"},
                   {"delta", "rad", "steering angle of the front wheel, to the left"}},
        .outputs = {{"vy", "m/s", "lateral velocity of the centre of mass, to the left"},
                    {"r", "rad/s", "yaw rate, to the left"},
                    {"ay", "m/s^2", "lateral acceleration of the centre of mass, vy' + vx r"},
                    {"beta", "rad", "sideslip angle of the centre of mass, atan2(vy, vx)"}},
    };
  }

  template <class Real>
  static void Initial(const std::array<Real, kParameters>& parameters,
                      std::array<Real, kStates>& states) {
    const auto& [m, Iz, lf, lr, Cf, Cr, mu, vy_0, r_0] = parameters;
    states = {vy_0, r_0};
  }

  template <class Real>
  static void Derivatives(double, const std::array<Real, kStates>& states,
                          const std::array<Real, kParameters>& parameters,
                          const std::array<Real, kInputs>& inputs,
                          std::array<Real, kStates>& derivatives) {
    const auto& [vy, r] = states;
    const auto& [m, Iz, lf, lr, Cf, Cr, mu, vy_0, r_0] = parameters;
    const auto& [vx, delta] = inputs;
    const auto [front, rear] = LateralForces(states, parameters, inputs);
    // v̇y = (Ff cos δ + Fr)/m − vx r,  ṙ = (lf Ff cos δ − lr Fr)/Iz
    derivatives[0] = (front + rear) / m - vx * r;
    derivatives[1] = (lf * front - lr * rear) / Iz;
  }

  template <class Real>
  static void Outputs(double, const std::array<Real, kStates>& states,
                      const std::array<Real, kParameters>& parameters,
                      const std::array<Real, kInputs>& inputs,
                      std::array<Real, kOutputs>& outputs) {
    const auto& [vy, r] = states;
    const auto& [vx, delta] = inputs;
    const auto [front, rear] = LateralForces(states, parameters, inputs);
    // v̇y + vx r = (Ff cos δ + Fr)/m
    outputs = {vy, r, (front + rear) / parameters[0], Atan2(vy, PositiveOrNan(vx))};
  }

 private:
  // Returns Ff cos δ and Fr.
  template <class Real>
  static std::array<Real, 2> LateralForces(const std::array<Real, kStates>& states,
                                           const std::array<Real, kParameters>& parameters,
                                           const std::array<Real, kInputs>& inputs) {
    constexpr double g = 9.81;
    const auto& [vy, r] = states;
    const auto& [m, Iz, lf, lr, Cf, Cr, mu, vy_0, r_0] = parameters;
    const auto& [vx, delta] = inputs;
    const Real forward = PositiveOrNan(vx);
    // αf = δ − atan2(vy + lf r, vx),  αr = −atan2(vy − lr r, vx)
    const Real slip_front = delta - Atan2(Real(vy + lf * r), forward);
    const Real slip_rear = -Atan2(Real(vy - lr * r), forward);
    // mu Fz
    const Real grip_front = mu * (m * g * lr / (lf + lr));
    const Real grip_rear = mu * (m * g * lf / (lf + lr));
    return {TyreForce<Real>(Cf * slip_front, grip_front) * Cos(delta),
            TyreForce<Real>(Cr * slip_rear, grip_rear)};
  }

  // Returns F/√(1 + (F/grip)²) for the linear tyre force F.
  template <class Real>
  static Real TyreForce(const Real& linear, const Real& grip) {
    const Real share = linear / grip;
    return linear / Sqrt(Real(1 + share * share));
  }
};

}  // namespace polyest::internal::builtin
