#pragma once

// One corner of a vehicle: the sprung mass ms stands on a suspension, and the unsprung mass mu
// below it on a tyre of stiffness kt whose contact point follows the road. Displacements are
// measured from static equilibrium, positive upwards, and the suspension's travel is zs − zu.
// Newton's law for the two masses is
//
//   ms z̈s = −F,   mu z̈u = F + kt (road − zu),   F = ks travel + ks3 travel³ + cs travel'.
//
// In the linear case (ks3 = 0), the transfer functions from the road are, with c = cs s + ks,
//
//   zs/road = kt c/D,   zu/road = kt (ms s² + c)/D,   D = (ms s² + c)(mu s² + c + kt) − c².
//
// The model is valid while the tyre keeps contact, kt (zu − road) < (ms + mu) g, and the suspension
// is off its stops. The tyre has no damping. ks and ks3 are the stiffnesses at the static load. ms
// and mu must be above 0.

#include <array>

#include "polyest/model.h"

namespace polyest::internal::builtin {

struct QuarterCar {
  static constexpr int kStates = 4;
  static constexpr int kParameters = 10;
  static constexpr int kInputs = 1;
  static constexpr int kOutputs = 5;
  static constexpr bool kUsesTime = false;
  static constexpr std::array<int, 1> kNonlinear = {5};  // ks3

  static ModelDescription Describe() {
    return {
        .name = "quarter_car",
        .summary = "One corner of a vehicle over a road: body, suspension, wheel and tyre",
        .equations =
            "ms zs'' = -F;  mu zu'' = F + kt (road - zu);  "
            "F = ks travel + ks3 travel^3 + cs travel', travel = zs - zu",
        .source =
            "Newton's law of the two masses; the quarter-car model of vehicle dynamics, as in "
            "D. Hrovat, Survey of advanced suspension developments, Automatica 33 (1997)",
        .states = {{"zs", "m", "displacement of the sprung mass"},
                   {"zu", "m", "displacement of the unsprung mass"},
                   {"vs", "m/s", "velocity of the sprung mass"},
                   {"vu", "m/s", "velocity of the unsprung mass"}},
        .parameters = {{"ms", "kg", "sprung mass", 290},
                       {"mu", "kg", "unsprung mass", 59},
                       {"ks", "N/m", "linear stiffness of the suspension", 16800},
                       {"cs", "N s/m", "damping coefficient of the suspension", 1000},
                       {"kt", "N/m", "stiffness of the tyre", 190000},
                       {"ks3", "N/m^3", "cubic stiffness of the suspension", 0},
                       {"zs_0", "m", "initial displacement of the sprung mass", 0},
                       {"zu_0", "m", "initial displacement of the unsprung mass", 0},
                       {"vs_0", "m/s", "initial velocity of the sprung mass", 0},
                       {"vu_0", "m/s", "initial velocity of the unsprung mass", 0}},
        .inputs = {{"road", "m", "height of the road under the tyre"}},
        .outputs = {{"zs", "m", "displacement of the sprung mass"},
                    {"zu", "m", "displacement of the unsprung mass"},
                    {"travel", "m", "travel of the suspension, zs - zu"},
                    {"travel_rate", "m/s", "rate of travel of the suspension"},
                    {"zs_accel", "m/s^2", "acceleration of the sprung mass"}},
    };
  }

  template <class Real>
  static void Initial(const std::array<Real, kParameters>& parameters,
                      std::array<Real, kStates>& states) {
    const auto& [ms, mu, ks, cs, kt, ks3, zs_0, zu_0, vs_0, vu_0] = parameters;
    states = {zs_0, zu_0, vs_0, vu_0};
  }

  template <class Real>
  static void Derivatives(double, const std::array<Real, kStates>& states,
                          const std::array<Real, kParameters>& parameters,
                          const std::array<Real, kInputs>& inputs,
                          std::array<Real, kStates>& derivatives) {
    const auto& [zs, zu, vs, vu] = states;
    const auto& [ms, mu, ks, cs, kt, ks3, zs_0, zu_0, vs_0, vu_0] = parameters;
    const auto& [road] = inputs;
    const Real F = SuspensionForce(states, parameters);
    derivatives[0] = vs;
    derivatives[1] = vu;
    // z̈s = −F/ms,  z̈u = (F + kt (road − zu))/mu
    derivatives[2] = -F / ms;
    derivatives[3] = (F + kt * (road - zu)) / mu;
  }

  template <class Real>
  static void Outputs(double, const std::array<Real, kStates>& states,
                      const std::array<Real, kParameters>& parameters,
                      const std::array<Real, kInputs>&, std::array<Real, kOutputs>& outputs) {
    const auto& [zs, zu, vs, vu] = states;
    const auto& ms = parameters[0];
    const Real F = SuspensionForce(states, parameters);
    outputs = {zs, zu, zs - zu, vs - vu, -F / ms};
  }

 private:
  // F = ks travel + ks3 travel³ + cs travel'
  template <class Real>
  static Real SuspensionForce(const std::array<Real, kStates>& states,
                              const std::array<Real, kParameters>& parameters) {
    const auto& [zs, zu, vs, vu] = states;
    const auto& [ms, mu, ks, cs, kt, ks3, zs_0, zu_0, vs_0, vu_0] = parameters;
    const Real travel = zs - zu;
    return (ks + ks3 * travel * travel) * travel + cs * (vs - vu);
  }
};

}  // namespace polyest::internal::builtin
