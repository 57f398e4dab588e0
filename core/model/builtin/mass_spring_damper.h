#pragma once

#include <array>
#include <numbers>

#include "polyest/model.h"

namespace polyest::internal::builtin {

// The oscillator m ẍ + c ẋ + k x = force. Without damping and force it is equation (26) of the
// paper.
struct MassSpringDamper {
  static constexpr int kStates = 2;
  static constexpr int kParameters = 5;
  static constexpr int kInputs = 1;
  static constexpr int kOutputs = 3;
  static constexpr bool kUsesTime = false;
  static constexpr std::array<int, 0> kNonlinear = {};

  static ModelDescription Describe() {
    const double omega = 2 * std::numbers::pi;  // gives k the default for 1 Hz
    return {
        .name = "mass_spring_damper",
        .summary = "A mass on a linear spring and damper, driven by a force",
        .equations = "m x'' + c x' + k x = force;  a = x''",
        .source = "Newton's law; the oscillator of the paper's sections 3.1 to 3.3",
        .states = {{"x", "m", "displacement from the unloaded spring"}, {"v", "m/s", "velocity"}},
        .parameters = {{"m", "kg", "mass", 0.1},
                       {"c", "N s/m", "damping coefficient", 0},
                       {"k", "N/m", "spring stiffness", 0.1 * omega * omega},
                       {"x0", "m", "initial displacement", 0},
                       {"v0", "m/s", "initial velocity", 0}},
        .inputs = {{"force", "N", "force on the mass, positive along x"}},
        .outputs = {{"x", "m", "displacement"},
                    {"v", "m/s", "velocity"},
                    {"a", "m/s^2", "acceleration"}},
    };
  }

  template <class Real>
  static void Initial(const std::array<Real, kParameters>& parameters,
                      std::array<Real, kStates>& states) {
    const auto& [m, c, k, x0, v0] = parameters;
    states = {x0, v0};
  }

  template <class Real>
  static void Derivatives(double, const std::array<Real, kStates>& states,
                          const std::array<Real, kParameters>& parameters,
                          const std::array<Real, kInputs>& inputs,
                          std::array<Real, kStates>& derivatives) {
    derivatives = {states[1], Acceleration(states, parameters, inputs)};
  }

  template <class Real>
  static void Outputs(double, const std::array<Real, kStates>& states,
                      const std::array<Real, kParameters>& parameters,
                      const std::array<Real, kInputs>& inputs,
                      std::array<Real, kOutputs>& outputs) {
    outputs = {states[0], states[1], Acceleration(states, parameters, inputs)};
  }

 private:
  template <class Real>
  static Real Acceleration(const std::array<Real, kStates>& states,
                           const std::array<Real, kParameters>& parameters,
                           const std::array<Real, kInputs>& inputs) {
    const auto& [x, v] = states;
    const auto& [m, c, k, x0, v0] = parameters;
    const auto& [force] = inputs;
    // ẍ = (force − c v − k x)/m
    return (force - c * v - k * x) / m;
  }
};

}  // namespace polyest::internal::builtin
