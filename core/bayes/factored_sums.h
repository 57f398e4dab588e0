#pragma once

// The χ² of mismatch sums through a factor of G with as few columns as matter:
//
//   χ²(d) = ‖Fᵀd‖² − 2 bᵀd + w,   G ≈ F Fᵀ,   F of S × r,
//
// by Cholesky's factorization with pivoting (Higham, Accuracy and Stability of Numerical
// Algorithms, 2002, ch. 10), ended when tr(G − F Fᵀ) has become negligible. The rest is positive
// semidefinite, and with polynomials orthonormal over the region its trace is the mean of what
// ‖Fᵀd‖² lacks there. The rank is at most the number of samples, and small too where the outputs
// are smooth over the region (10 to 30 of 462 terms in problems of five and six parameters), so
// that products with F cost a fraction of those with G.

#include <mutex>

#include "core/bayes/mismatch_sums.h"
#include "core/common/types.h"

namespace polyest::internal {

// May be read by several threads at once.
class FactoredSums {
 public:
  // Will factor the sums when the factor is needed first, which costs O(S r²). The trace left out
  // is at most 10⁻⁶, far less than what a sampler of 10⁵ draws can tell, or else rounding of G. If
  // `relative`, it is at most so much times the least mean square of the residuals, for likelihoods
  // that are functions of log χ². The sums must be complete and outlive the object.
  FactoredSums(const MismatchSums* sums, bool relative) : sums_(sums), relative_(relative) {}

  int rank() const { return static_cast<int>(Factor().cols()); }

  // Return χ² at one point, whose d has S numbers, and write its derivatives by d into `gradient`
  // (S): through F where that is less work than through G.
  double ChiSquared(const ConstVectorRef& d) const;
  double ChiSquaredWithGradient(const ConstVectorRef& d, VectorRef gradient) const;
  // Returns ∂φᵀ G ∂φ, n × n; `phi_gradient` = ∂φ is S × n.
  Matrix Information(const ConstMatrixRef& phi_gradient) const;
  // Writes χ² at W points into `values` (W); `differences` is W × S. `product` is scratch memory,
  // resized to W × r. Does not allocate if it has its size already.
  void ChiSquaredMany(const ConstMatrixRef& differences, Matrix& product, VectorRef values) const;

 private:
  const Matrix& Factor() const;
  bool FactorPays() const;

  const MismatchSums* sums_;
  bool relative_;
  mutable std::once_flag once_;
  mutable Matrix factor_;  // F
};

}  // namespace polyest::internal
