#pragma once

#include <array>

#include "polyest/model.h"

namespace polyest::internal::builtin {

// Equation (57) of the paper. θ drives both states equally, so x₁ − x₂ carries no information about
// it.
struct LinearTwoState {
  static constexpr int kStates = 2;
  static constexpr int kParameters = 3;
  static constexpr int kInputs = 2;
  static constexpr int kOutputs = 3;
  static constexpr bool kUsesTime = false;
  static constexpr std::array<int, 0> kNonlinear = {};

  static ModelDescription Describe() {
    return {
        .name = "linear_two_state",
        .summary = "Two coupled linear states driven by a constant that their difference hides",
        .equations = "x1' = -2 x1 + x2 + theta + u1;  x2' = x1 - 2 x2 + theta + u2",
        .source = "equation (57) of the paper's section 3.5",
        .states = {{"x1", "1", "first state"}, {"x2", "1", "second state"}},
        .parameters = {{"theta", "1/s", "constant that drives both states", 0},
                       {"x1_0", "1", "initial value of x1", 0},
                       {"x2_0", "1", "initial value of x2", 0}},
        .inputs = {{"u1", "1/s", "excitation of x1"}, {"u2", "1/s", "excitation of x2"}},
        .outputs = {{"x1", "1", "first state"},
                    {"x2", "1", "second state"},
                    {"x1_minus_x2", "1", "difference x1 - x2, independent of theta"}},
    };
  }

  template <class Real>
  static void Initial(const std::array<Real, kParameters>& parameters,
                      std::array<Real, kStates>& states) {
    const auto& [theta, x1_0, x2_0] = parameters;
    states = {x1_0, x2_0};
  }

  template <class Real>
  static void Derivatives(double, const std::array<Real, kStates>& states,
                          const std::array<Real, kParameters>& parameters,
                          const std::array<Real, kInputs>& inputs,
                          std::array<Real, kStates>& derivatives) {
    const auto& [x1, x2] = states;
    const auto& [theta, x1_0, x2_0] = parameters;
    const auto& [u1, u2] = inputs;
    // ẋ₁ = −2 x₁ + x₂ + θ + u₁,  ẋ₂ = x₁ − 2 x₂ + θ + u₂
    derivatives[0] = -2.0 * x1 + x2 + theta + u1;
    derivatives[1] = x1 - 2.0 * x2 + theta + u2;
  }

  template <class Real>
  static void Outputs(double, const std::array<Real, kStates>& states,
                      const std::array<Real, kParameters>&, const std::array<Real, kInputs>&,
                      std::array<Real, kOutputs>& outputs) {
    const auto& [x1, x2] = states;
    outputs[0] = x1;
    outputs[1] = x2;
    outputs[2] = x1 - x2;
  }
};

}  // namespace polyest::internal::builtin
