#pragma once

// Shows errors that last for many samples although successive residuals are hardly correlated, such
// as white noise with a small share that changes slowly: sums of successive residuals then vary
// more than those of white noise. With v_k = (∂y_k/∂η, e_k)/√R_k, gradient and residual at a fixed
// point η_c as in correlation_profile.h, u_k(δ) the residual of the linearized model at η_c + δ,
// and blocks B of kLength samples, the variance ratio is
//   Σ_B (Σ_{k∈B} u_k)² / Σ_B Σ_{k∈B} u_k².
// If the noise is white, it is χ² of the number of blocks, divided by that number.
//
// Source: Lo and MacKinlay, Stock market prices do not follow random walks: evidence from a simple
// specification test, Review of Financial Studies 1 (1988) 41–66.

#include <cstdint>

#include "core/common/types.h"

namespace polyest::internal {

class ResidualBlocks {
 public:
  static constexpr int kLength = 16;

  explicit ResidualBlocks(Eigen::Index unknowns = 0);

  // Adds a sample: its gradient (n) and its residual, in units of its noise. Takes O(n²) operations
  // and does not allocate.
  void Add(const ConstVectorRef& gradient, double residual);
  // Forgets an unfinished block, because correlation does not extend over runs.
  void BeginRun();

  // Returns the same without any sample.
  ResidualBlocks Renewed() const { return ResidualBlocks(sum_.size() - 1); }

  int64_t count() const { return count_; }  // of whole blocks
  // Return the variance ratio, and the mean square of the residuals in whole blocks, at δ (n);
  // require a block.
  double VarianceRatio(const ConstVectorRef& delta) const;
  double MeanSquare(const ConstVectorRef& delta) const;

  // Whether these could be of as many unknowns as the other ones.
  bool HasSizesOf(const ResidualBlocks& other) const;

  template <class Archive>
  void serialize(Archive& archive) {
    archive(count_, in_block_, sum_, block_, samples_, sums_);
  }

 private:
  int64_t count_ = 0;
  int in_block_ = 0;  // samples of the present block
  Vector sum_;        // Σ v of it
  Matrix block_;      // Σ v vᵀ of it
  Matrix samples_;    // Σ v vᵀ of the samples in whole blocks
  Matrix sums_;       // Σ (Σ v)(Σ v)ᵀ of whole blocks
};

}  // namespace polyest::internal
