#pragma once

#include <array>

#include "polyest/model.h"

namespace polyest::internal::builtin {

// An oscillator with a polynomial spring: m ẍ + c ẋ + k x + k2 x² + k3 x³ = force + offset. For a
// linear spring, offset = k x_e gives the rest position x_e.
struct Duffing {
  static constexpr int kStates = 2;
  static constexpr int kParameters = 8;
  static constexpr int kInputs = 1;
  static constexpr int kOutputs = 2;
  static constexpr bool kUsesTime = false;
  static constexpr std::array<int, 2> kNonlinear = {3, 4};  // k2, k3

  static ModelDescription Describe() {
    return {
        .name = "duffing",
        .summary = "An oscillator with a cubic polynomial spring, driven by a force",
        .equations = "m x'' + c x' + k x + k2 x^2 + k3 x^3 = force + offset",
        .source =
            "G. Duffing, Erzwungene Schwingungen bei veränderlicher Eigenfrequenz, 1918; "
            "with a quadratic and a constant term as in the silverbox benchmark",
        .states = {{"x", "m", "displacement"}, {"v", "m/s", "velocity"}},
        .parameters = {{"m", "kg", "mass", 1},
                       {"c", "N s/m", "damping coefficient", 0.1},
                       {"k", "N/m", "linear stiffness", 1},
                       {"k2", "N/m^2", "quadratic stiffness", 0},
                       {"k3", "N/m^3", "cubic stiffness", 1},
                       {"offset", "N", "constant force", 0},
                       {"x0", "m", "initial displacement", 0},
                       {"v0", "m/s", "initial velocity", 0}},
        .inputs = {{"force", "N", "force on the mass, positive along x"}},
        .outputs = {{"x", "m", "displacement"}, {"v", "m/s", "velocity"}},
    };
  }

  template <class Real>
  static void Initial(const std::array<Real, kParameters>& parameters,
                      std::array<Real, kStates>& states) {
    const auto& [m, c, k, k2, k3, offset, x0, v0] = parameters;
    states = {x0, v0};
  }

  template <class Real>
  static void Derivatives(double, const std::array<Real, kStates>& states,
                          const std::array<Real, kParameters>& parameters,
                          const std::array<Real, kInputs>& inputs,
                          std::array<Real, kStates>& derivatives) {
    const auto& [x, v] = states;
    const auto& [m, c, k, k2, k3, offset, x0, v0] = parameters;
    const auto& [force] = inputs;
    // ẍ = (force + offset − c v − (k + (k2 + k3 x) x) x)/m
    derivatives[0] = v;
    derivatives[1] = (force + offset - c * v - (k + (k2 + k3 * x) * x) * x) / m;
  }

  template <class Real>
  static void Outputs(double, const std::array<Real, kStates>& states,
                      const std::array<Real, kParameters>&, const std::array<Real, kInputs>&,
                      std::array<Real, kOutputs>& outputs) {
    outputs = states;
  }
};

}  // namespace polyest::internal::builtin
