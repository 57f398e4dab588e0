#pragma once

// The likelihood of a run without its own parameters, from an expansion over the shared germs and
// its own (problem/ended_runs.h has the formulas).
//
// In the expansion's local coordinates the integrand is e^{−J(η)}, η = origin + D η_φ: the origin
// is a place of the shared germs and D has the directions of the run's own. The minimum there is
// found by Newton's method with steps of at most a half width. The integral is taken
//   for one parameter     by Gauss–Legendre within 7 standard deviations of the minimum and Ω,
//   for two or three      by Gauss–Hermite about the minimum in the metric of the Hessian,
//   for more              as that of the Gaussian at the minimum (Laplace).

#include "core/bayes/cost.h"
#include "core/common/types.h"

namespace polyest::internal {

// The integrand about one origin.
struct ConditionalMinimum {
  Vector own;  // η_φ of the minimum (n_φ)
  // ∂²J/∂η_φ², n_φ × n_φ; positive definite, since a shift is added where it is not.
  Matrix hessian;
  double value = 0;  // J there
};

class RunMarginal {
 public:
  // `directions` is D, n × n_φ with n_φ ≥ 1. `cost` must outlive this.
  RunMarginal(const Cost& cost, Matrix directions);

  // Returns the minimum over η_φ, from a starting point.
  ConditionalMinimum Minimize(const Vector& origin, const Vector& start) const;
  // Returns −log ∫ e^{−J} dη_φ; +∞ if the integrand vanishes.
  double NegativeLogIntegral(const Vector& origin, const ConditionalMinimum& minimum) const;

 private:
  double IntegrateLine(const Vector& origin, const ConditionalMinimum& minimum) const;
  double IntegrateBox(const Vector& origin, const ConditionalMinimum& minimum) const;

  const Cost& cost_;
  Matrix directions_;
};

}  // namespace polyest::internal
