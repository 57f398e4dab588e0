#pragma once

// What an experiment is expected to tell, before it is made.
//
// With samples y_k(ξ) + noise of variance R_k, and a_k = L ∂y_k/∂ξ /√R_k (L = diag of the germs'
// standard deviations), the posterior of the scaled germs near a truth ξ is Gaussian with the
// precision
//   M(ξ) = Id + Σ_k a_k a_kᵀ,
// the prior being taken for Gaussian too, and the information gained is
//   ½ log₂ det M(ξ)  bits:
// one bit halves the standard deviation in one direction. Its expectation is the mean over draws of
// the truth (Laplace's approximation of the expected information gain; K. Chaloner and I.
// Verdinelli, "Bayesian experimental design: a review", Statist. Sci. 10, 1995). It does not see
// that a posterior may have several pieces.

#include <vector>

#include "core/bayes/prior.h"
#include "core/common/linear_algebra.h"
#include "core/common/types.h"
#include "polyest/experiment_design.h"

namespace polyest::internal {

// Draws of the truth from a prior: a stretch of Halton's sequence.
class TruthDraws {
 public:
  // Points first … first + count − 1 of the sequence. `prior` must outlive the draws.
  TruthDraws(const Prior& prior, int first, int count);

  int count() const { return static_cast<int>(xis_.rows()); }
  Vector xi(int draw) const { return xis_.row(draw).transpose(); }
  const Vector& germ_standard_deviation() const { return scale_; }

  // From Σ_k a_k a_kᵀ (n × n) of each draw.
  InformationGain Expected(const std::vector<Matrix>& information) const;

 private:
  Vector StandardDeviation(int draw, const Matrix& lower_root) const;

  const Prior& prior_;
  Vector mean_;   // of ξ
  Vector scale_;  // its standard deviations
  Matrix xis_;    // draws × n
};

// Returns the factor of Id + information.
inline CholeskyFactor FactorPrecision(const Matrix& information) {
  return CholeskyFactor(Matrix::Identity(information.rows(), information.cols()) + information);
}

}  // namespace polyest::internal
