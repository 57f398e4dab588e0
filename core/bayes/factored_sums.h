#pragma once

// The χ² of mismatch sums at many points, through a factor of G with as few columns as matter:
//
//   χ²(d) = ‖Fᵀd‖² − 2 bᵀd + w,   G ≈ F Fᵀ,   F of S × r,
//
// by Cholesky's factorization with pivoting (Higham, Accuracy and Stability of Numerical
// Algorithms, 2002, ch. 10), ended when tr(G − F Fᵀ) has become negligible. The rest is positive
// semidefinite, and with polynomials orthonormal over the region its trace is the mean of what
// ‖Fᵀd‖² lacks there. The rank is at most the number of samples, and small too where the outputs
// are smooth over the region, so that the product D F (W × S times S × r) costs a fraction of D G.

#include "core/bayes/mismatch_sums.h"
#include "core/common/types.h"

namespace polyest::internal {

class FactoredSums {
 public:
  // Factors the sums. The trace left out is at most 10⁻⁶, far less than what a sampler of 10⁵
  // draws can tell, or else rounding of G. If `relative`, it is at most so much times the least
  // mean square of the residuals, for likelihoods that are functions of log χ².
  FactoredSums(const MismatchSums& sums, bool relative);

  int rank() const { return static_cast<int>(factor_.cols()); }
  // Writes χ² at W points into `values` (W); `differences` is W × S. `product` is scratch memory,
  // resized to W × r. Does not allocate if it has its size already.
  void ChiSquaredMany(const ConstMatrixRef& differences, Matrix& product, VectorRef values) const;

 private:
  Matrix factor_;  // F
  Vector b_;
  double w_;
};

}  // namespace polyest::internal
