#pragma once

// The cost (24)–(25) with the regularization weight of (56), on an expansion over a region,
//   J(η) = β (J_mismatch(η) + J_0(η)) + α² J_apriori(ξ(η)) + J_P(ξ(η)),   ξ = centre + axes η,
// with the power β = 1 of the likelihood unless the posterior is tempered, a polynomial J_0 that is
// 0 unless parameters have been eliminated (estimator/problem/ended_runs.h), and J_P that is 0
// unless runs share a population (population_cost.h), with exact derivatives: J_mismatch is a
// function of quadratic forms in φ(η) (mismatch.h), φ a polynomial. What J_P has of runs that have
// ended is part of their likelihood, too, and has the power β: only the sum is bounded below.

#include <memory>
#include <utility>

#include "core/bayes/element.h"
#include "core/bayes/mismatch.h"
#include "core/bayes/population_cost.h"
#include "core/bayes/prior.h"
#include "core/bayes/region.h"
#include "core/chaos/basis.h"
#include "polyest/estimate.h"

namespace polyest::internal {

class Cost {
 public:
  // Requires that the sums of `mismatch` are taken about `reference` (η_0), and that
  // `regularization` = α² ≥ 0. The cost is +∞ outside Ω and outside `element`.
  Cost(std::shared_ptr<const Basis> basis, Region region, Vector reference, Mismatch mismatch,
       Prior prior, double regularization, Element element = Element());

  int dimension() const { return region_.dimension(); }
  const Region& region() const { return region_; }
  const Prior& prior() const { return prior_; }
  const Element& element() const { return element_; }
  double regularization() const { return regularization_; }
  // The power β of the likelihood, 0 … 1. It enters the total and its derivatives but not
  // CostValue::mismatch.
  double power() const { return power_; }
  void set_power(double power) { power_ = power; }
  // Returns the cost that an estimate minimizes, of the noise and the prior as they were stated: β
  // is 1, and J_apriori is constant in uniform parameters (Prior::WithModesOfUniform).
  Cost AsStated() const;

  // The number of threads, ≥ 1, on which EvaluateMany computes; its results do not depend on it.
  int threads() const { return threads_; }
  void set_threads(int threads) { threads_ = threads; }

  // Sets J_0(η) = coefficientsᵀ φ(η). It enters the total and its derivatives alone.
  void set_remainder(Vector coefficients);

  // Sets J_P. It enters the total and its derivatives alone.
  void set_population(std::shared_ptr<const PopulationCost> population) {
    population_ = std::move(population);
  }

  CostValue Evaluate(const ConstVectorRef& eta) const;
  // `gradient` (n) is with respect to η.
  CostValue EvaluateWithGradient(const ConstVectorRef& eta, VectorRef gradient) const;
  // Returns the Hessian (n × n) of β J_mismatch with respect to η. If a noise scale is unknown, the
  // likelihood is a Student's t in the parameters, whose curvature at the mode is that of too
  // narrow a Gaussian; subtracting `spent` degrees of freedom (parameters fitted, plus 2) gives the
  // curvature of a Gaussian with the variance of the t.
  Matrix MismatchHessian(const ConstVectorRef& eta, double spent = 0) const;
  // Returns the Hessian of β J_mismatch + J_P likewise; J_P holds what the record says of the
  // parameters of its runs and the prior does not.
  Matrix InformationHessian(const ConstVectorRef& eta, double spent = 0) const;
  Matrix Hessian(const ConstVectorRef& eta, double spent = 0) const;  // of the total
  // Writes the total at W points (W × n) into `totals` (resized) by matrix products.
  void EvaluateMany(const ConstMatrixRef& etas, Vector& totals) const;
  // Returns d = φ(η) − φ(η_0), for the sums of single channels.
  Vector BasisDifference(const ConstVectorRef& eta) const;

 private:
  Matrix HessianOfData(const ConstVectorRef& eta, double spent, bool with_remainder) const;
  void AddPopulation(const ConstVectorRef& eta, Matrix& hessian) const;
  // EvaluateMany for one block of points.
  void EvaluateBlock(const ConstMatrixRef& etas, VectorRef totals) const;
  bool has_remainder() const { return remainder_.size() > 0; }
  bool Supports(const ConstVectorRef& xi) const {
    return prior_.Contains(xi) && element_.Contains(xi);
  }

  std::shared_ptr<const Basis> basis_;
  Region region_;
  Vector reference_phi_;
  Mismatch mismatch_;
  Prior prior_;
  double regularization_;
  Element element_;
  double power_ = 1;
  int threads_ = 1;
  Vector remainder_;                                  // coefficients of J_0; empty if it is 0
  double remainder_constant_ = 0;                     // J_0 at the reference
  std::shared_ptr<const PopulationCost> population_;  // J_P; null if it is 0
};

}  // namespace polyest::internal
