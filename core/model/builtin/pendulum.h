#pragma once

#include <array>
#include <cmath>

#include "core/model/vector_functions.h"
#include "polyest/model.h"

namespace polyest::internal::builtin {

// The damped pendulum θ̈ = −(g/ℓ) sin θ − c θ̇ − c2 θ̇ |θ̇|.
struct Pendulum {
  static constexpr int kStates = 2;
  static constexpr int kParameters = 5;
  static constexpr int kInputs = 0;
  static constexpr int kOutputs = 2;
  static constexpr bool kUsesTime = false;

  static ModelDescription Describe() {
    return {
        .name = "pendulum",
        .summary = "A pendulum at any angle with linear and quadratic damping",
        .equations = "theta'' = -g_over_l sin(theta) - c theta' - c2 theta' |theta'|",
        .source = "balance of moments about the pivot, divided by the inertia",
        .states = {{"theta", "rad", "angle from hanging"}, {"omega", "rad/s", "angular velocity"}},
        .parameters = {{"g_over_l", "1/s^2", "gravity over the reduced length", 9.81},
                       {"c", "1/s", "linear damping", 0},
                       {"c2", "1/rad", "quadratic damping", 0},
                       {"theta0", "rad", "initial angle", 0},
                       {"omega0", "rad/s", "initial angular velocity", 0}},
        .inputs = {},
        .outputs = {{"theta", "rad", "angle from hanging"}, {"omega", "rad/s", "angular velocity"}},
    };
  }

  template <class Real>
  static void Initial(const std::array<Real, kParameters>& parameters,
                      std::array<Real, kStates>& states) {
    const auto& [g_over_l, c, c2, theta0, omega0] = parameters;
    states = {theta0, omega0};
  }

  template <class Real>
  static void Derivatives(double, const std::array<Real, kStates>& states,
                          const std::array<Real, kParameters>& parameters,
                          const std::array<Real, kInputs>&,
                          std::array<Real, kStates>& derivatives) {
    using std::abs;
    const auto& [theta, omega] = states;
    const auto& [g_over_l, c, c2, theta0, omega0] = parameters;
    // ω̇ = −(g/ℓ) sin θ − (c + c2 |ω|) ω
    derivatives[0] = omega;
    derivatives[1] = -g_over_l * Sin(theta) - (c + c2 * abs(omega)) * omega;
  }

  template <class Real>
  static void Outputs(double, const std::array<Real, kStates>& states,
                      const std::array<Real, kParameters>&, const std::array<Real, kInputs>&,
                      std::array<Real, kOutputs>& outputs) {
    outputs = states;
  }
};

}  // namespace polyest::internal::builtin
