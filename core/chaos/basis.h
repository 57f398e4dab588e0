#pragma once

// The orthonormal polynomial basis (2) in n independent germs, truncated at total degree p or
// hyperbolically (multi_index.h),
//   φ_s(ξ) = Π_k P^(k)_{j_sk}(ξ_k),   ∫ φ_s φ_r ρ dξ = δ_sr,   φ_0 = 1.
//
// The orthonormal polynomials of one germ follow from its monic recurrence, a_j and b_j, by
//   √b_{j+1} P_{j+1}(ξ) = (ξ − a_j) P_j(ξ) − √b_j P_{j−1}(ξ),   P_0 = 1.
// They are themselves terms of the basis, and every other term is the product of two earlier ones:
// with k the last variable that occurs in φ_s,
//   φ_s = φ_parent(s) · P^(k)_{j_sk}(ξ_k),   parent(s) = s without its variable k,
// so each of the S values costs one multiplication, and no memory beside the result is needed.

#include <utility>
#include <vector>

#include "core/chaos/germ.h"
#include "core/chaos/multi_index.h"
#include "core/common/types.h"

namespace polyest::internal {

class Basis {
 public:
  // `germs` must not be empty.
  Basis(std::vector<Germ> germs, Truncation truncation);
  // Truncates at the total degree `order` ≥ 0.
  Basis(std::vector<Germ> germs, int order) : Basis(std::move(germs), Truncation{order, 1}) {}

  int dimension() const { return static_cast<int>(germs_.size()); }
  int order() const { return truncation_.order; }
  const Truncation& truncation() const { return truncation_; }
  int size() const { return static_cast<int>(indices_.rows()); }
  const std::vector<Germ>& germs() const { return germs_; }
  const Eigen::ArrayXXi& indices() const { return indices_; }

  // Writes φ(ξ) into `phi` (S); `xi` has n entries. Does not allocate.
  void Evaluate(const ConstVectorRef& xi, VectorRef phi) const;
  // Writes φ(ξ) into `phi` and its derivatives by ξ into `gradient` (S × n). Does not allocate.
  void EvaluateWithGradient(const ConstVectorRef& xi, VectorRef phi, MatrixRef gradient) const;
  // Returns Σ_s weights_s ∇²φ_s(ξ), a symmetric n × n matrix, given φ(ξ) and its derivatives by ξ.
  Matrix WeightedHessian(const ConstVectorRef& xi, const ConstVectorRef& phi,
                         const ConstMatrixRef& gradient, const ConstVectorRef& weights) const;
  // Evaluates φ at W points: `points` is W × n; `values` becomes W × S and is allocated anew only
  // if its size changes. Vectorized over the points.
  void EvaluateMany(const ConstMatrixRef& points, Matrix& values) const;

 private:
  // A term φ_s, given by the earlier terms whose product it is.
  struct Term {
    int variable;  // k, the last variable that occurs in the term
    int degree;    // j_sk
    int parent;    // the term without k; 0, the constant, for a polynomial of one germ alone
    int single;    // the term P^(k)_{j_sk}; s itself when parent is 0
    int previous;  // if parent is 0: the term P^(k) of one degree less,
    int second;    // and the one of two degrees less (−1 for degree 1)
  };

  void FindTerms();

  std::vector<Germ> germs_;
  Truncation truncation_;
  Eigen::ArrayXXi indices_;
  std::vector<Term> terms_;  // of terms 1 … S − 1
  Matrix a_;                 // a_j of germ k, (p + 1) × n
  Matrix sqrt_b_;            // √b_j of germ k, (p + 1) × n
};

}  // namespace polyest::internal
