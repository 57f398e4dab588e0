#pragma once

// The samples of a channel whose noise has outliers, each kept by itself, while they are few.
//
// Weights turn such samples into mismatch sums in constant memory (noise.h), but they hold near the
// point at which they were taken. Few samples leave a posterior so wide that the weights change
// over it, or with several modes, each of which other samples contradict. Their likelihood is
// therefore taken as it is. With u_k = (z_k − c_kᵀ φ)/√R_k = ε_k − a_kᵀ d, d = φ − φ_0, a_k =
// c_k/√R_k,
//
//   J_mismatch = Σ ρ(u_k),   ∂J/∂d = −Σ ρ′(u_k) a_k,   ∂²J/∂d² = Σ ρ″(u_k) a_k a_kᵀ,
//
// with −log of the noise's density ρ (RobustLoss). An evaluation takes O(N S) operations, which for
// up to about S samples is not more than the sums take.

#include <cstdint>

#include "core/common/types.h"
#include "polyest/noise.h"

namespace polyest::internal {

class RobustSamples {
 public:
  // Without outliers (kNone) it stands for a channel that keeps no samples.
  explicit RobustSamples(OutlierHandling outliers = OutlierHandling::kNone, int terms = 0)
      : outliers_(outliers), scaled_(terms, 0) {}

  OutlierHandling outliers() const { return outliers_; }
  int64_t count() const { return count_; }
  // Whether the sizes are those of samples by so many terms, and all numbers are finite.
  bool IsValid(int terms) const;

  // Adds one sample: coefficients c (S), error e = z − cᵀφ_0, variance R > 0. Allocates when the
  // memory, which doubles, is full.
  void Add(const ConstVectorRef& coefficients, double error, double variance);
  // Returns the samples by other terms, as MismatchSums::Substituted does.
  RobustSamples Substituted(const ConstMatrixRef& t, const ConstVectorRef& shift,
                            double variance = 1) const;

  // Returns J_mismatch at d.
  double Evaluate(const ConstVectorRef& d) const;
  // Returns it, and adds its derivatives by d to `gradient` (S).
  double EvaluateAddingGradient(const ConstVectorRef& d, VectorRef gradient) const;
  // Returns ∂φᵀ (∂²J/∂d²) ∂φ, n × n; `phi_gradient` = ∂φ is S × n.
  Matrix Curvature(const ConstVectorRef& d, const ConstMatrixRef& phi_gradient) const;
  // Adds J_mismatch at W points to `values` (W); `differences` is W × S. `product` is scratch
  // memory, resized to W × N.
  void AddTo(VectorRef values, const ConstMatrixRef& differences, Matrix& product) const;

  // How the samples lie about the prediction at d: χ² = Σ w u² by their weights there, and what of
  // it belongs to those with less than half their weight.
  struct Judgement {
    double chi_squared = 0;
    int64_t outliers = 0;
    double of_outliers = 0;
  };
  Judgement JudgedAt(const ConstVectorRef& d) const;

  // Write to or read from a cereal archive. What is read is not checked.
  template <class Archive>
  void save(Archive& archive) const {
    archive(static_cast<int>(outliers_), count_, scaled_, errors_);
  }
  template <class Archive>
  void load(Archive& archive) {
    int outliers = 0;
    archive(outliers, count_, scaled_, errors_);
    outliers_ = static_cast<OutlierHandling>(outliers);
  }

 private:
  Vector Residuals(const ConstVectorRef& d) const;  // u (N)

  OutlierHandling outliers_;
  int64_t count_ = 0;
  Matrix scaled_;  // a_k, S × as many as there is memory for
  Vector errors_;  // ε_k
};

}  // namespace polyest::internal
