#pragma once

// Mismatch sums: a channel's whole history in constant memory. With y_k(η) = c_kᵀ φ(η), a fixed
// reference point with φ_0 = φ(η_0), d = φ − φ_0 and e_k = z_k − c_kᵀ φ_0, it is the quadratic form
//
//   J_mismatch(η) = ½ Σ_k (z_k − y_k(η))²/R_k = ½ (dᵀ G d − 2 bᵀ d + w),
//   G = Σ c_k c_kᵀ/R_k,   b = Σ c_k e_k/R_k,   w = Σ e_k²/R_k.
//
// The sums are taken about the reference and not about zero, because w would otherwise be the
// energy of the signal and the far smaller energy of the residual would be lost to rounding.
//
// Adding to G is most of the work, and G is larger than the nearest cache. Samples therefore wait
// until there are eight, which are added in one pass over the lower triangle. Each element is
// summed in the order of the samples, so that the bits do not depend on when G is read.

#include <array>
#include <cstdint>

#include "core/common/types.h"

namespace polyest::internal {

class MismatchSums {
 public:
  explicit MismatchSums(int terms);

  int terms() const { return static_cast<int>(b_.size()); }
  int64_t count() const { return count_; }
  // Returns G (S × S), completed.
  const Matrix& G() const;
  const Vector& b() const { return b_; }
  double w() const { return w_; }

  // Adds the samples that wait to G. All functions that need G do so first: until it has been done
  // once after the last Add, the sums are not safe to read from two threads.
  void Complete() const;

  // Adds one sample: coefficients c (S), error e = z − cᵀφ_0, variance R > 0. Takes O(S²)
  // operations. The first call allocates memory for the samples that wait, later ones none.
  void Add(const ConstVectorRef& coefficients, double error, double variance);
  void Add(const MismatchSums& other);
  // Returns the sums by other terms φ′ with φ ≈ Tᵀφ′, about a reference φ′_0: with d = Tᵀd′ + δ,
  //   G′ = T G Tᵀ,   b′ = T (b − G δ),   w′ = w − 2 bᵀδ + δᵀG δ,
  // all divided by `variance`, a factor of the noise's variance. `t` is S′ × S, `shift` = δ (S).
  MismatchSums Substituted(const ConstMatrixRef& t, const ConstVectorRef& shift,
                           double variance = 1) const;
  // Whether sums that were read from a snapshot have this number of terms and are finite.
  bool IsValid(int terms) const;

  // Returns χ² = 2 J_mismatch at d.
  double ChiSquared(const ConstVectorRef& d) const;
  // Returns χ² at d; `gradient` (S) is with respect to d.
  double ChiSquaredWithGradient(const ConstVectorRef& d, VectorRef gradient) const;

  // Write to or read from a cereal archive. The shapes of what is read are not checked.
  template <class Archive>
  void save(Archive& archive) const {
    archive(G(), b_, w_, count_);
  }
  template <class Archive>
  void load(Archive& archive) {
    archive(g_, b_, w_, count_);
    waiting_ = 0;
    is_whole_ = true;
  }

 private:
  static constexpr int kTogether = 8;  // so many samples are added to G in one pass

  void AddWaiting() const;
  // Adds the samples that wait to kColumns columns of G from `first` on.
  template <int kColumns>
  void AddTo(Eigen::Index first) const;

  mutable Matrix g_;              // without the samples that wait
  mutable int waiting_ = 0;       // their number
  mutable bool is_whole_ = true;  // whether the upper triangle of g_ mirrors the lower one
  Matrix coefficients_;           // S × kTogether: c of the samples that wait
  std::array<double, kTogether> weights_ = {};  // their 1/R
  Vector b_;
  double w_ = 0;
  int64_t count_ = 0;
};

}  // namespace polyest::internal
