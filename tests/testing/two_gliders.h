#pragma once

// Models two gliders between three springs on an air track, displacements about rest positions o1,
// o2:
//   x1″ = −(a + b)(x1 − o1) + b (x2 − o2) − c1 x1′
//   x2″ =  g (x1 − o1) − (g + h)(x2 − o2) − c2 x2′
// with a = k1/m1, b = k2/m1, g = k2/m2, h = k3/m2: twelve unknowns with the initial states.

#include <array>

#include "core/model/lane_model.h"
#include "polyest/problem.h"

namespace polyest::internal::testing {

struct TwoGliders {
  static constexpr int kStates = 4;
  static constexpr int kParameters = 12;
  static constexpr int kInputs = 0;
  static constexpr int kOutputs = 2;

  static ModelDescription Describe();

  template <class Real>
  static void Initial(const std::array<Real, kParameters>& parameters,
                      std::array<Real, kStates>& states) {
    states = {parameters[8], parameters[9], parameters[10], parameters[11]};
  }

  template <class Real>
  static void Derivatives(double, const std::array<Real, kStates>& states,
                          const std::array<Real, kParameters>& parameters,
                          const std::array<Real, kInputs>&,
                          std::array<Real, kStates>& derivatives) {
    const auto& [x1, x2, v1, v2] = states;
    const auto& [a, b, g, h, c1, c2, o1, o2, x1_0, x2_0, v1_0, v2_0] = parameters;
    const Real e1 = x1 - o1;
    const Real e2 = x2 - o2;
    derivatives = {v1, v2, Real(b * e2 - (a + b) * e1 - c1 * v1),
                   Real(g * e1 - (g + h) * e2 - c2 * v2)};
  }

  template <class Real>
  static void Outputs(double, const std::array<Real, kStates>& states,
                      const std::array<Real, kParameters>&, const std::array<Real, kInputs>&,
                      std::array<Real, kOutputs>& outputs) {
    outputs = {states[0], states[1]};
  }
};

// Returns the problem: broad uniform priors, both displacements measured with a noise of 0.62
// pixels.
Problem TwoGlidersProblem(int order);

}  // namespace polyest::internal::testing
