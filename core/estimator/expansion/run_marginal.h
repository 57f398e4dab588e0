#pragma once

// The likelihood of a run without its own parameters, from an expansion over the shared germs and
// its own (problem/ended_runs.h has the formulas).
//
// In the expansion's local coordinates η = (η_θ, η_φ) the integrand is e^{−J(η_θ, η_φ)}. At a given
// η_θ, its minimum is found by Newton's method with steps of at most a half width. The integral is
// taken
//   for one parameter     by Gauss–Legendre within 7 standard deviations of the minimum and Ω,
//   for two or three      by Gauss–Hermite about the minimum in the metric of the Hessian,
//   for more              as that of the Gaussian at the minimum (Laplace).

#include "core/bayes/cost.h"
#include "core/common/types.h"

namespace polyest::internal {

// The integrand at one place of the shared germs.
struct ConditionalMinimum {
  Vector own;  // η_φ of the minimum (n_φ)
  // ∂²J/∂η_φ², n_φ × n_φ; positive definite, since a shift is added where it is not.
  Matrix hessian;
  double value = 0;  // J there
};

class RunMarginal {
 public:
  // The first `shared` local coordinates of the cost are those of the shared germs; `own` are the
  // indices of the run's own germs. `cost` must outlive this.
  RunMarginal(const Cost& cost, int shared, std::vector<int> own);

  // Returns the minimum over η_φ at η_θ, from a starting point.
  ConditionalMinimum Minimize(const ConstVectorRef& eta_shared, const Vector& start) const;
  // Returns −log ∫ e^{−J} dη_φ at η_θ; +∞ if the integrand vanishes.
  double NegativeLogIntegral(const ConstVectorRef& eta_shared,
                             const ConditionalMinimum& minimum) const;

 private:
  Vector Joined(const ConstVectorRef& eta_shared, const ConstVectorRef& eta_own) const;
  double IntegrateLine(const ConstVectorRef& eta_shared, const ConditionalMinimum& minimum) const;
  double IntegrateBox(const ConstVectorRef& eta_shared, const ConditionalMinimum& minimum) const;

  const Cost& cost_;
  Eigen::Index shared_;
  std::vector<int> own_;
};

}  // namespace polyest::internal
