#pragma once

// A bar of mass M, roll inertia I about its centre and length L on two springs whose lower ends are
// displaced by u₁ and u₂; x₁ and x₂ are the displacements of the bar's ends. From
//
//   T = ½ M ((ẋ₁ + ẋ₂)/2)² + ½ I ((ẋ₂ − ẋ₁)/L)²,   V = ½ k₁ (x₁ − u₁)² + ½ k₂ (x₂ − u₂)²,
//
// with Fᵢ = kᵢ (xᵢ − uᵢ), Lagrange's equations are
//
//   (M/4 + I/L²) ẍ₁ + (M/4 − I/L²) ẍ₂ = −F₁,
//   (M/4 − I/L²) ẍ₁ + (M/4 + I/L²) ẍ₂ = −F₂;
//
// The sum of the two is the balance of forces, and their difference the balance of moments about
// the centre:
//
//   M (ẍ₁ + ẍ₂)/2 + F₁ + F₂ = 0,   I (ẍ₂ − ẍ₁)/L − (L/2) (F₁ − F₂) = 0.
//
// The first is equation (58) of the paper. The second differs from the paper, which prints
//
//   I (ẍ₂ − ẍ₁)/L + F₁ − F₂ = 0.
//
// The printed form adds a moment to a force because the arm L/2 is missing. With its sign the
// springs would push the bar further over (with k₁ = k₂ = k, roll would grow like exp(t √(k L/I))),
// so it must be a misprint.

#include <array>

#include "polyest/model.h"

namespace polyest::internal::builtin {

struct RollPlane2Dof {
  static constexpr int kStates = 4;
  static constexpr int kParameters = 9;
  static constexpr int kInputs = 2;
  static constexpr int kOutputs = 4;
  static constexpr bool kUsesTime = false;
  static constexpr std::array<int, 0> kNonlinear = {};

  static ModelDescription Describe() {
    return {
        .name = "roll_plane_2dof",
        .summary = "A bar on two springs, driven at their feet: heave and roll",
        .equations =
            "M (x1'' + x2'')/2 + F1 + F2 = 0;  I (x2'' - x1'')/L - (L/2) (F1 - F2) = 0;  "
            "F1 = k1 (x1 - u1), F2 = k2 (x2 - u2)",
        .source =
            "equation (58) of the paper's section 3.6, its moment balance corrected: the "
            "lever arm L/2 is added and the springs' moment restores",
        .states = {{"x1", "m", "displacement of the left end"},
                   {"x2", "m", "displacement of the right end"},
                   {"v1", "m/s", "velocity of the left end"},
                   {"v2", "m/s", "velocity of the right end"}},
        .parameters = {{"M", "kg", "mass of the bar", 580},
                       {"I", "kg m^2", "roll inertia of the bar about its centre", 63.3316},
                       {"L", "m", "length of the bar", 1.524},
                       {"k1", "N/m", "stiffness of the left spring", 19357.2},
                       {"k2", "N/m", "stiffness of the right spring", 19357.2},
                       {"x1_0", "m", "initial displacement of the left end", 0},
                       {"x2_0", "m", "initial displacement of the right end", 0},
                       {"v1_0", "m/s", "initial velocity of the left end", 0},
                       {"v2_0", "m/s", "initial velocity of the right end", 0}},
        .inputs = {{"u1", "m", "displacement of the left spring's foot"},
                   {"u2", "m", "displacement of the right spring's foot"}},
        .outputs = {{"x1", "m", "displacement of the left end"},
                    {"x2", "m", "displacement of the right end"},
                    {"v1", "m/s", "velocity of the left end"},
                    {"v2", "m/s", "velocity of the right end"}},
    };
  }

  template <class Real>
  static void Initial(const std::array<Real, kParameters>& parameters,
                      std::array<Real, kStates>& states) {
    const auto& [M, I, L, k1, k2, x1_0, x2_0, v1_0, v2_0] = parameters;
    states = {x1_0, x2_0, v1_0, v2_0};
  }

  template <class Real>
  static void Derivatives(double, const std::array<Real, kStates>& states,
                          const std::array<Real, kParameters>& parameters,
                          const std::array<Real, kInputs>& inputs,
                          std::array<Real, kStates>& derivatives) {
    const auto& [x1, x2, v1, v2] = states;
    const auto& [M, I, L, k1, k2, x1_0, x2_0, v1_0, v2_0] = parameters;
    const auto& [u1, u2] = inputs;
    // Fᵢ = kᵢ (xᵢ − uᵢ)
    const Real F1 = k1 * (x1 - u1);
    const Real F2 = k2 * (x2 - u2);
    // (ẍ₁ + ẍ₂)/2 = −(F₁ + F₂)/M
    const Real heave = -(F1 + F2) / M;
    // (ẍ₂ − ẍ₁)/2 = L² (F₁ − F₂)/(4 I)
    const Real roll = 0.25 * L * L * (F1 - F2) / I;
    derivatives[0] = v1;
    derivatives[1] = v2;
    derivatives[2] = heave - roll;
    derivatives[3] = heave + roll;
  }

  template <class Real>
  static void Outputs(double, const std::array<Real, kStates>& states,
                      const std::array<Real, kParameters>&, const std::array<Real, kInputs>&,
                      std::array<Real, kOutputs>& outputs) {
    outputs = states;
  }
};

}  // namespace polyest::internal::builtin
