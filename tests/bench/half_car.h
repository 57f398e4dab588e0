#pragma once

// Defines the half car of the benchmarks, a model of eight states: a bar on two corners with wheels
// and tyres (roll_plane_4dof of the models' documentation, with the road as an input).

#include <algorithm>
#include <array>
#include <cmath>

#include "core/model/lane_model.h"

namespace polyest::internal::bench {

struct HalfCar {
  static constexpr int kStates = 8;
  static constexpr int kParameters = 2;  // m_a, d
  static constexpr int kInputs = 2;      // y1, y2
  static constexpr int kOutputs = 4;     // d1, d2 and their rates

  static ModelDescription Describe() {
    ModelDescription description;
    description.name = "half_car";
    for (const char* name : {"x1", "x2", "xt1", "xt2", "v1", "v2", "vt1", "vt2"}) {
      description.states.push_back({name, "m", ""});
    }
    description.parameters = {{"m_a", "kg", "", 0}, {"d", "m", "", 0.762}};
    description.inputs = {{"y1", "m", ""}, {"y2", "m", ""}};
    for (const char* name : {"d1", "d2", "d1_rate", "d2_rate"}) {
      description.outputs.push_back({name, "m", ""});
    }
    return description;
  }

  template <class Real>
  static void Initial(const std::array<Real, kParameters>& parameters,
                      std::array<Real, kStates>& states) {
    for (Real& state : states) state = 0 * parameters[0];
  }

  template <class Real>
  static void Derivatives(double, const std::array<Real, kStates>& x,
                          const std::array<Real, kParameters>& parameters,
                          const std::array<Real, kInputs>& road, std::array<Real, kStates>& rates) {
    constexpr double kMass = 580, kInertia = 63.3316, kLength = 1.524, kWheel = 36.26;
    constexpr double kStiffness = 19357.2, kCubic = 100000, kFriction = 142.14, kTyre = 96319.76;
    const Real d1 = x[0] - x[2];
    const Real d2 = x[1] - x[3];
    // F = k d + k3 d³ + c_f tanh(10 ḋ)
    const Real f1 =
        (kStiffness + kCubic * d1 * d1) * d1 + kFriction * Tanh(Real(10 * (x[4] - x[6])));
    const Real f2 =
        (kStiffness + kCubic * d2 * d2) * d2 + kFriction * Tanh(Real(10 * (x[5] - x[7])));
    constexpr double kSum = kMass / 4 + kInertia / (kLength * kLength);
    constexpr double kDifference = kMass / 4 - kInertia / (kLength * kLength);
    const Real share = parameters[1] / kLength;
    const Real m11 = kSum + parameters[0] * (1 - share) * (1 - share);
    const Real m12 = kDifference + parameters[0] * share * (1 - share);
    const Real m22 = kSum + parameters[0] * share * share;
    const Real inverse = 1 / (m11 * m22 - m12 * m12);
    rates = {x[4],
             x[5],
             x[6],
             x[7],
             (m12 * f2 - m22 * f1) * inverse,
             (m12 * f1 - m11 * f2) * inverse,
             (f1 + kTyre * (road[0] - x[2])) / kWheel,
             (f2 + kTyre * (road[1] - x[3])) / kWheel};
  }

  template <class Real>
  static void Outputs(double, const std::array<Real, kStates>& x,
                      const std::array<Real, kParameters>&, const std::array<Real, kInputs>&,
                      std::array<Real, kOutputs>& y) {
    y = {x[0] - x[2], x[1] - x[3], x[4] - x[6], x[5] - x[7]};
  }
};

// The reference scenario: bumps 0.05 m high, left at 0.5–0.7 s and right at 1.1–1.3 s.
inline constexpr double kBumpHeight = 0.05;
inline constexpr double kBumpStart[2] = {0.5, 1.1};
inline constexpr double kBumpDuration = 0.2;
// Times at which an input has a kink.
inline constexpr double kBreaks[] = {0.5, 0.7, 1.1, 1.3};

// Returns the road under a side: a half sine during the bump. The middle of the integration step
// decides on which side of a kink the step is.
inline double Road(int side, double time_s, double step_middle_s) {
  const double start = kBumpStart[side];
  if (step_middle_s < start || step_middle_s > start + kBumpDuration) return 0;
  return kBumpHeight * std::sin(M_PI * (time_s - start) / kBumpDuration);
}

}  // namespace polyest::internal::bench
