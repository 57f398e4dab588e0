#pragma once

// The expected information gain of an experiment that has not been made yet.
//
// Let the samples be y_k(ξ) + noise of variance R_k, and a_k = L ∂y_k/∂ξ /√R_k, where L is the
// diagonal matrix of the germs' standard deviations. Near a true value ξ, the posterior of the
// scaled germs is Gaussian with the precision
//   M(ξ) = Id + Σ_k a_k a_kᵀ,
// if the prior is taken as Gaussian too, and the information gained is
//   ½ log₂ det M(ξ)  bits:
// one bit halves the standard deviation in one direction. The expected gain is the mean over draws
// of the true value (Laplace's approximation of the expected information gain; K. Chaloner and I.
// Verdinelli, "Bayesian experimental design: a review", Statist. Sci. 10, 1995). It does not
// account for posteriors with several pieces.

#include <vector>

#include "core/bayes/prior.h"
#include "core/common/linear_algebra.h"
#include "core/common/types.h"
#include "polyest/experiment_design.h"

namespace polyest::internal {

// Returns `count` draws of the true value from a prior, a row each: points of Halton's sequence.
Matrix DrawTruths(const Prior& prior, int count);

// Draws of the true value.
class TruthDraws {
 public:
  // `prior` must outlive the draws, which are rows of `xis`.
  TruthDraws(const Prior& prior, Matrix xis);

  int count() const { return static_cast<int>(xis_.rows()); }
  Vector xi(int draw) const { return xis_.row(draw).transpose(); }
  const Vector& germ_standard_deviation() const { return scale_; }

  // Returns the expected gain, from Σ_k a_k a_kᵀ (n × n) for each draw.
  InformationGain Expected(const std::vector<Matrix>& information) const;

 private:
  Vector StandardDeviation(int draw, const Matrix& lower_root) const;

  const Prior& prior_;
  Vector mean_;   // mean of ξ
  Vector scale_;  // standard deviations of ξ
  Matrix xis_;    // draws × n
};

// Returns the factor of Id + information.
inline CholeskyFactor FactorPrecision(const Matrix& information) {
  return CholeskyFactor(Matrix::Identity(information.rows(), information.cols()) + information);
}

}  // namespace polyest::internal
