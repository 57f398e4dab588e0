#pragma once

// A channel's whole history in constant memory. With y_k(η) = c_kᵀ φ(η), a fixed reference point
// with φ_0 = φ(η_0), d = φ − φ_0 and e_k = z_k − c_kᵀ φ_0, the mismatch is the quadratic form
//
//   J_mismatch(η) = ½ Σ_k (z_k − y_k(η))²/R_k = ½ (dᵀ G d − 2 bᵀ d + w),
//   G = Σ c_k c_kᵀ/R_k,   b = Σ c_k e_k/R_k,   w = Σ e_k²/R_k.
//
// The sums are taken about the reference and not about zero because w would otherwise be the
// signal's energy, from whose digits the residual's would have to be recovered.

#include <cstdint>

#include "core/common/types.h"

namespace polyest {

class MismatchSums {
 public:
  explicit MismatchSums(int terms);

  int terms() const { return static_cast<int>(b_.size()); }
  int64_t count() const { return count_; }
  const Matrix& G() const { return g_; }
  const Vector& b() const { return b_; }
  double w() const { return w_; }

  // One sample: coefficients c (S), e = z − cᵀφ_0, variance R > 0. O(S²), no allocation.
  void Add(const ConstVectorRef& coefficients, double error, double variance);
  void Add(const MismatchSums& other);
  // 2 J_mismatch = χ² at d.
  double ChiSquared(const ConstVectorRef& d) const;
  // The same; gradient (S) is with respect to d.
  double ChiSquaredWithGradient(const ConstVectorRef& d, VectorRef gradient) const;
  // The same at W points: differences is W × S, values W (sized). product is scratch (resized).
  void ChiSquaredMany(const ConstMatrixRef& differences, Matrix& product, VectorRef values) const;

  // As cereal has it: for writing and for reading; what was read may have any shape.
  template <class Archive>
  void serialize(Archive& archive) {
    archive(g_, b_, w_, count_);
  }

 private:
  Matrix g_;  // symmetric, both triangles kept
  Vector b_;
  double w_ = 0;
  int64_t count_ = 0;
};

}  // namespace polyest
