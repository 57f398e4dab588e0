#pragma once

// The samples of a channel whose noise is relative to the prediction, each kept by itself, while
// they are few.
//
// A step of Fisher's scoring turns such samples into mismatch sums in constant memory
// (relative_noise.h), but holds near the prediction at which it was taken. Few samples with much
// noise leave a posterior over which the noise itself changes: weights taken at a prediction far
// from the truth favour large predictions. Their likelihood is therefore taken as it is. With
// y_k = c_kᵀ φ, e_k = z_k − y_k, d = φ − φ_0 and R_k(y) = σ_k(y)² + ρ_k,
//
//   A(d) = Σ e_k²/R_k(y_k),   L(d) = Σ log(R_k(y_k)/R⁰_k),
//   −log of the likelihood = ½ A + ½ L, or ½ N (1 + log(A/N)) + ½ L if the scale of σ is unknown,
//
// up to a constant. R⁰, the variance at some prediction, keeps L near 0 where the posterior is. An
// evaluation takes O(N S) operations, as for samples with outliers (robust_samples.h).

#include <cstdint>

#include "core/common/types.h"
#include "polyest/noise.h"

namespace polyest::internal {

// σ as a function of the prediction y: at_zero + slope·max(|y|, least_magnitude).
struct RelativeDeviation {
  double at_zero = 0;
  double slope = 0;
  double least_magnitude = 0;

  // Returns `scale` times the noise of the model, whose `relative` must be above 0, where the
  // largest sample so far is `largest`.
  static RelativeDeviation Of(const NoiseModel& model, double largest, double scale);
  double At(double y) const;
};

class RelativeSamples {
 public:
  // If it does not keep samples, it stands for a channel of other noise.
  explicit RelativeSamples(bool keeps = false, int terms = 0)
      : keeps_(keeps), coefficients_(terms, 0), facts_(kFacts, 0) {}

  bool keeps() const { return keeps_; }
  int64_t count() const { return count_; }
  // Whether the sizes are those of samples by so many terms, and all numbers are finite.
  bool IsValid(int terms) const;

  // Adds one sample: coefficients c (S), the prediction y_0 = cᵀφ_0, σ(y) > 0, ρ ≥ 0 and R⁰ > 0.
  // Allocates when the memory, which doubles, is full.
  void Add(const ConstVectorRef& coefficients, double z, double predicted,
           const RelativeDeviation& deviation, double own_error, double reference_variance);
  // Returns the samples by other terms, as MismatchSums::Substituted does.
  RelativeSamples Substituted(const ConstMatrixRef& t, const ConstVectorRef& shift) const;

  struct Totals {
    double chi_squared = 0;   // A
    double log_variance = 0;  // L
  };
  Totals At(const ConstVectorRef& d) const;
  // Returns them, and writes their derivatives by d (S).
  Totals WithGradients(const ConstVectorRef& d, VectorRef of_chi_squared,
                       VectorRef of_log_variance) const;
  // Returns ∂φᵀ (a ∂²A/∂d² + l ∂²L/∂d²) ∂φ, n × n; `phi_gradient` = ∂φ is S × n.
  Matrix Curvature(const ConstVectorRef& d, const ConstMatrixRef& phi_gradient, double a,
                   double l) const;
  // Writes A and L at W points (W); `differences` is W × S. `product` is scratch memory, resized to
  // W × N.
  void EvaluateMany(const ConstMatrixRef& differences, Matrix& product, VectorRef chi_squared,
                    VectorRef log_variance) const;

  // Write to or read from a cereal archive. What is read is not checked.
  template <class Archive>
  void save(Archive& archive) const {
    archive(static_cast<int>(keeps_), count_, coefficients_, facts_);
  }
  template <class Archive>
  void load(Archive& archive) {
    int keeps = 0;
    archive(keeps, count_, coefficients_, facts_);
    keeps_ = keeps != 0;
  }

 private:
  // What is kept of a sample beside its coefficients, the rows of facts_.
  enum Fact : Eigen::Index {
    kValue,      // z
    kPredicted,  // y_0
    kAtZero,     // of RelativeDeviation
    kSlope,
    kMinMagnitude,
    kOwnError,  // ρ
    kReference  // R⁰
  };
  static constexpr Eigen::Index kFacts = kReference + 1;

  // R and its derivatives by y at a prediction of the k-th sample.
  struct Variance {
    double value = 0, first = 0, second = 0;
  };
  Variance VarianceAt(int64_t k, double y) const;
  // Returns y (N) at d.
  Vector Predictions(const ConstVectorRef& d) const;

  bool keeps_;
  int64_t count_ = 0;
  Matrix coefficients_;  // c_k, S × as many as there is memory for
  Matrix facts_;
};

}  // namespace polyest::internal
