#pragma once

// A half car seen from behind. A bar of mass M, roll inertia I about its centre and length L stands
// at each end on a suspension, each suspension on a wheel of mass m_t, and each wheel on a tyre of
// stiffness k_t whose contact point follows the road. A point mass m_a sits on the bar at the
// distance d from its left end. Let x₁, x₂ be the displacements of the bar's ends, xt₁, xt₂ those
// of the wheels, y₁, y₂ the road's height, δ = d/L and dᵢ = xᵢ − xtᵢ the travel of a suspension,
// with displacements measured from static equilibrium. From
//
//   T = ½ M ((ẋ₁ + ẋ₂)/2)² + ½ I ((ẋ₂ − ẋ₁)/L)² + ½ m_a ((1 − δ) ẋ₁ + δ ẋ₂)² + ½ m_t (ẋt₁² + ẋt₂²),
//   V = Σᵢ ½ k dᵢ² + ¼ k3 dᵢ⁴ + ½ k_t (yᵢ − xtᵢ)²,
//
// and the friction c_f tanh(10 ḋᵢ) of each corner, Lagrange's equations are, with J = I/L² and the
// corner forces Fᵢ = k dᵢ + k3 dᵢ³ + c_f tanh(10 ḋᵢ),
//
//   [ M/4 + J + m_a (1−δ)²   M/4 − J + m_a δ(1−δ) ] [ẍ₁]   [ −F₁ ]
//   [ M/4 − J + m_a δ(1−δ)   M/4 + J + m_a δ²     ] [ẍ₂] = [ −F₂ ],
//   m_t ẍtᵢ = Fᵢ + k_t (yᵢ − xtᵢ).
//
// The mass matrix is inverted with its determinant in expanded form, M J + m_a (J + M (1 − 2δ)²/4),
// in which nothing cancels. The determinant is above 0 for M, I, L > 0 and m_a ≥ 0, wherever the
// point mass sits; 0 ≤ d ≤ L places it on the bar.
//
// The model is valid for small roll (x₂ − x₁ ≪ L) and while the tyres keep contact: the static load
// of a tyre, (M + m_a) g/2 + m_t g for a symmetric load, must stay above k_t (xtᵢ − yᵢ). The 10 in
// the friction has the unit s/m. It smooths Coulomb's c_f sign ḋᵢ over |ḋᵢ| of about 0.1 m/s, so a
// suspension creeps where dry friction would hold it. The springs' forces are measured from static
// equilibrium too: k and k3 belong to the loaded vehicle.

#include <array>

#include "core/model/lane.h"
#include "polyest/model.h"

namespace polyest::internal::builtin {

struct RollPlane4Dof {
  static constexpr int kStates = 8;
  static constexpr int kParameters = 18;
  static constexpr int kInputs = 2;
  static constexpr int kOutputs = 10;
  static constexpr bool kUsesTime = false;
  static constexpr std::array<int, 2> kNonlinear = {5, 6};  // k3, c_f

  static ModelDescription Describe() {
    return {
        .name = "roll_plane_4dof",
        .summary = "A half car over a road, with a point mass anywhere on it: heave, roll, wheels",
        .equations =
            "(M/4 + I/L^2 + m_a (1-D)^2) x1'' + (M/4 - I/L^2 + m_a D (1-D)) x2'' = -F1;  "
            "(M/4 - I/L^2 + m_a D (1-D)) x1'' + (M/4 + I/L^2 + m_a D^2) x2'' = -F2;  "
            "m_t xti'' = Fi + k_t (yi - xti);  D = d/L, di = xi - xti, "
            "Fi = k di + k3 di^3 + c_f tanh(10 di')",
        .source =
            "Lagrange's equations of a rigid bar on two quarter cars, after the half car of the "
            "paper's second part",
        .states = {{"x1", "m", "displacement of the bar's left end"},
                   {"x2", "m", "displacement of the bar's right end"},
                   {"xt1", "m", "displacement of the left wheel"},
                   {"xt2", "m", "displacement of the right wheel"},
                   {"v1", "m/s", "velocity of the bar's left end"},
                   {"v2", "m/s", "velocity of the bar's right end"},
                   {"vt1", "m/s", "velocity of the left wheel"},
                   {"vt2", "m/s", "velocity of the right wheel"}},
        .parameters = {{"M", "kg", "mass of the bar", 580},
                       {"I", "kg m^2", "roll inertia of the bar about its centre", 63.3316},
                       {"L", "m", "length of the bar, the track", 1.524},
                       {"m_t", "kg", "mass of a wheel", 36.26},
                       {"k", "N/m", "linear stiffness of a suspension", 19357.2},
                       {"k3", "N/m^3", "cubic stiffness of a suspension", 100000},
                       {"c_f", "N", "friction force of a suspension", 142.14},
                       {"k_t", "N/m", "stiffness of a tyre", 96319.76},
                       {"m_a", "kg", "point mass on the bar", 0},
                       {"d", "m", "distance of the point mass from the bar's left end", 0.762},
                       {"x1_0", "m", "initial displacement of the bar's left end", 0},
                       {"x2_0", "m", "initial displacement of the bar's right end", 0},
                       {"xt1_0", "m", "initial displacement of the left wheel", 0},
                       {"xt2_0", "m", "initial displacement of the right wheel", 0},
                       {"v1_0", "m/s", "initial velocity of the bar's left end", 0},
                       {"v2_0", "m/s", "initial velocity of the bar's right end", 0},
                       {"vt1_0", "m/s", "initial velocity of the left wheel", 0},
                       {"vt2_0", "m/s", "initial velocity of the right wheel", 0}},
        .inputs = {{"y1", "m", "height of the road under the left tyre"},
                   {"y2", "m", "height of the road under the right tyre"}},
        .outputs = {{"d1", "m", "travel of the left suspension, x1 - xt1"},
                    {"d2", "m", "travel of the right suspension, x2 - xt2"},
                    {"d1_rate", "m/s", "rate of travel of the left suspension"},
                    {"d2_rate", "m/s", "rate of travel of the right suspension"},
                    {"x1", "m", "displacement of the bar's left end"},
                    {"x2", "m", "displacement of the bar's right end"},
                    {"xt1", "m", "displacement of the left wheel"},
                    {"xt2", "m", "displacement of the right wheel"},
                    {"a1", "m/s^2", "acceleration of the bar's left end"},
                    {"a2", "m/s^2", "acceleration of the bar's right end"}},
    };
  }

  template <class Real>
  static void Initial(const std::array<Real, kParameters>& parameters,
                      std::array<Real, kStates>& states) {
    const auto& [M, I, L, m_t, k, k3, c_f, k_t, m_a, d, x1_0, x2_0, xt1_0, xt2_0, v1_0, v2_0, vt1_0,
                 vt2_0] = parameters;
    states = {x1_0, x2_0, xt1_0, xt2_0, v1_0, v2_0, vt1_0, vt2_0};
  }

  template <class Real>
  static void Derivatives(double, const std::array<Real, kStates>& states,
                          const std::array<Real, kParameters>& parameters,
                          const std::array<Real, kInputs>& inputs,
                          std::array<Real, kStates>& derivatives) {
    const auto& [x1, x2, xt1, xt2, v1, v2, vt1, vt2] = states;
    const auto& m_t = parameters[3];
    const auto& k_t = parameters[7];
    const auto& [y1, y2] = inputs;
    const std::array<Real, 2> F = CornerForces(states, parameters);
    const std::array<Real, 2> a = BarAccelerations(F, parameters);
    derivatives[0] = v1;
    derivatives[1] = v2;
    derivatives[2] = vt1;
    derivatives[3] = vt2;
    derivatives[4] = a[0];
    derivatives[5] = a[1];
    // ẍtᵢ = (Fᵢ + k_t (yᵢ − xtᵢ))/m_t
    derivatives[6] = (F[0] + k_t * (y1 - xt1)) / m_t;
    derivatives[7] = (F[1] + k_t * (y2 - xt2)) / m_t;
  }

  template <class Real>
  static void Outputs(double, const std::array<Real, kStates>& states,
                      const std::array<Real, kParameters>& parameters,
                      const std::array<Real, kInputs>&, std::array<Real, kOutputs>& outputs) {
    const auto& [x1, x2, xt1, xt2, v1, v2, vt1, vt2] = states;
    const std::array<Real, 2> a = BarAccelerations(CornerForces(states, parameters), parameters);
    outputs = {x1 - xt1, x2 - xt2, v1 - vt1, v2 - vt2, x1, x2, xt1, xt2, a[0], a[1]};
  }

 private:
  // Fᵢ = k dᵢ + k3 dᵢ³ + c_f tanh(10 ḋᵢ)
  template <class Real>
  static std::array<Real, 2> CornerForces(const std::array<Real, kStates>& states,
                                          const std::array<Real, kParameters>& parameters) {
    const auto& [x1, x2, xt1, xt2, v1, v2, vt1, vt2] = states;
    const auto& [M, I, L, m_t, k, k3, c_f, k_t, m_a, d, x1_0, x2_0, xt1_0, xt2_0, v1_0, v2_0, vt1_0,
                 vt2_0] = parameters;
    const Real d1 = x1 - xt1;
    const Real d2 = x2 - xt2;
    const Real smooth_sign1 = Tanh(Real(10 * (v1 - vt1)));
    const Real smooth_sign2 = Tanh(Real(10 * (v2 - vt2)));
    return {(k + k3 * d1 * d1) * d1 + c_f * smooth_sign1,
            (k + k3 * d2 * d2) * d2 + c_f * smooth_sign2};
  }

  // Returns ẍ₁ and ẍ₂, solved with the mass matrix [A B; B C].
  template <class Real>
  static std::array<Real, 2> BarAccelerations(const std::array<Real, 2>& F,
                                              const std::array<Real, kParameters>& parameters) {
    const auto& [M, I, L, m_t, k, k3, c_f, k_t, m_a, d, x1_0, x2_0, xt1_0, xt2_0, v1_0, v2_0, vt1_0,
                 vt2_0] = parameters;
    const Real J = I / (L * L);
    const Real delta = d / L;
    const Real A = 0.25 * M + J + m_a * (1 - delta) * (1 - delta);
    const Real B = 0.25 * M - J + m_a * delta * (1 - delta);
    const Real C = 0.25 * M + J + m_a * delta * delta;
    // A C − B² = M J + m_a (J + M (1 − 2δ)²/4)
    const Real determinant = M * J + m_a * (J + 0.25 * M * (1 - 2 * delta) * (1 - 2 * delta));
    return {(B * F[1] - C * F[0]) / determinant, (B * F[0] - A * F[1]) / determinant};
  }
};

}  // namespace polyest::internal::builtin
