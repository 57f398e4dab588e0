#pragma once

// The cost (24)–(25) with the regularization weight of (56), on an expansion over a region,
//   J(η) = J_mismatch(η) + α² J_apriori(ξ(η)),   ξ = centre + axes η,
// with exact derivatives: J_mismatch is a function of quadratic forms in φ(η) (mismatch.h), φ a
// polynomial.

#include <memory>

#include "core/bayes/mismatch.h"
#include "core/bayes/prior.h"
#include "core/bayes/region.h"
#include "core/chaos/basis.h"
#include "polyest/estimate.h"

namespace polyest::internal {

class Cost {
 public:
  // Requires that the sums of `mismatch` are taken about `reference` (η_0), and that
  // `regularization` = α² ≥ 0.
  Cost(std::shared_ptr<const Basis> basis, Region region, Vector reference, Mismatch mismatch,
       Prior prior, double regularization);

  int dimension() const { return region_.dimension(); }
  const Region& region() const { return region_; }
  const Prior& prior() const { return prior_; }
  double regularization() const { return regularization_; }

  CostValue Evaluate(const ConstVectorRef& eta) const;
  // `gradient` (n) is with respect to η.
  CostValue EvaluateWithGradient(const ConstVectorRef& eta, VectorRef gradient) const;
  // Returns the Hessian (n × n) of J_mismatch with respect to η. If a noise scale is unknown, the
  // likelihood is a Student's t in the parameters, whose curvature at the mode is that of too
  // narrow a Gaussian; subtracting `spent` degrees of freedom (parameters fitted, plus 2) gives the
  // curvature of a Gaussian with the variance of the t.
  Matrix MismatchHessian(const ConstVectorRef& eta, double spent = 0) const;
  Matrix Hessian(const ConstVectorRef& eta, double spent = 0) const;  // of the total
  // Writes the total at W points (W × n) into `totals` (resized) by matrix products; +∞ outside Ω.
  void EvaluateMany(const ConstMatrixRef& etas, Vector& totals) const;
  // Returns d = φ(η) − φ(η_0), for the sums of single channels.
  Vector BasisDifference(const ConstVectorRef& eta) const;

 private:
  std::shared_ptr<const Basis> basis_;
  Region region_;
  Vector reference_phi_;
  Mismatch mismatch_;
  Prior prior_;
  double regularization_;
};

}  // namespace polyest::internal
