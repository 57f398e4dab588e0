#pragma once

// The region in which an expansion interpolates: an affine image of the expansion's own coordinates
// η in the space of the germs, ξ = centre + axes η. At first it is the whole prior (centre 0, axes
// the identity, the germs' own polynomials); re-expansion moves it to where the posterior is (then
// η ∈ [−1, 1]^n and Legendre polynomials). The prior density and Ω do not change.

#include "core/common/linear_algebra.h"
#include "core/common/types.h"

namespace polyest::internal {

class Region {
 public:
  static Region WholePrior(int dimension);
  // `axes` (n × n) must be invertible. Their determinant may be far below the smallest double: 64
  // axes of 10⁻⁶ have 10⁻³⁸⁴.
  Region(Vector centre, Matrix axes);

  int dimension() const { return static_cast<int>(centre_.size()); }
  const Vector& centre() const { return centre_; }
  const Matrix& axes() const { return axes_; }
  double LogVolume() const;  // log |det axes|: the volume in units of that of the cube of η
  Vector ToGerm(const ConstVectorRef& eta) const;
  Vector ToLocal(const ConstVectorRef& xi) const;
  // Map W points at once, W × n.
  Matrix ManyToGerm(const ConstMatrixRef& etas) const;
  Matrix ManyToLocal(const ConstMatrixRef& xis) const;
  // Returns a cost's second derivative with respect to ξ, H_ξ = axes⁻ᵀ H_η axes⁻¹, from that with
  // respect to η.
  Matrix HessianToGerm(const ConstMatrixRef& hessian) const;

 private:
  Vector centre_;
  Matrix axes_;
  LuFactors factors_;
};

}  // namespace polyest::internal
