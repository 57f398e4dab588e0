#pragma once

// The orthonormal polynomial basis (2) of total degree p in n independent germs,
//   φ_s(ξ) = Π_k P^(k)_{j_sk}(ξ_k),   ∫ φ_s φ_r ρ dξ = δ_sr,   φ_0 = 1.

#include <vector>

#include "core/chaos/germ.h"
#include "core/common/types.h"

namespace polyest {

class Basis {
 public:
  // order ≥ 0; germs not empty.
  Basis(std::vector<Germ> germs, int order);

  int dimension() const { return static_cast<int>(germs_.size()); }
  int order() const { return order_; }
  int size() const { return static_cast<int>(indices_.rows()); }
  const std::vector<Germ>& germs() const { return germs_; }
  const Eigen::ArrayXXi& indices() const { return indices_; }

  // φ(ξ): xi is n, phi is S. Does not allocate beyond a small stack buffer.
  void Evaluate(const ConstVectorRef& xi, VectorRef phi) const;
  // φ and ∂φ: gradient is S × n.
  void EvaluateWithGradient(const ConstVectorRef& xi, VectorRef phi, MatrixRef gradient) const;
  // Σ_s weights_s ∇²φ_s(ξ): n × n, symmetric.
  Matrix WeightedHessian(const ConstVectorRef& xi, const ConstVectorRef& weights) const;
  // φ at W points at once: points is W × n, values is W × S (resized). Vectorized over the points.
  void EvaluateMany(const ConstMatrixRef& points, Matrix& values) const;

 private:
  std::vector<Germ> germs_;
  int order_;
  Eigen::ArrayXXi indices_;
  std::vector<RecurrenceCoefficients> recurrences_;
};

}  // namespace polyest
