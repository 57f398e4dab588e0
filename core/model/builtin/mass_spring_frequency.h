#pragma once

#include <array>
#include <numbers>

#include "core/model/vector_functions.h"
#include "polyest/model.h"

namespace polyest::internal::builtin {

// The algebraic model ω = √(k/m). A single measurement of ω determines only the ratio k/m, so the
// posterior is a valley in the plane of m and k.
struct MassSpringFrequency {
  static constexpr int kStates = 0;
  static constexpr int kParameters = 2;
  static constexpr int kInputs = 0;
  static constexpr int kOutputs = 1;

  static ModelDescription Describe() {
    const double omega = 2 * std::numbers::pi;
    return {
        .name = "mass_spring_frequency",
        .summary = "The natural frequency of a mass on a spring; algebraic, no states",
        .equations = "omega = sqrt(k/m)",
        .source = "the paper's section 3.4",
        .states = {},
        .parameters = {{"m", "kg", "mass", 200},
                       {"k", "N/m", "spring stiffness", 200 * omega * omega}},
        .inputs = {},
        .outputs = {{"omega", "rad/s", "undamped natural frequency"}},
    };
  }

  template <class Real>
  static void Outputs(double, const std::array<Real, kStates>&,
                      const std::array<Real, kParameters>& parameters,
                      const std::array<Real, kInputs>&, std::array<Real, kOutputs>& outputs) {
    const auto& [m, k] = parameters;
    // ω = √(k/m)
    outputs[0] = Sqrt(k / m);
  }
};

}  // namespace polyest::internal::builtin
