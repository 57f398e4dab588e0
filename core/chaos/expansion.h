#pragma once

// A polynomial chaos expansion y(ξ) = Σ_s c_s φ_s(ξ) of m outputs in an orthonormal basis (3).
//   mean = c_0,   standard deviation = √(Σ_{s≥1} c_s²)      (11)–(13); the paper lacks the root.

#include <memory>

#include "core/chaos/basis.h"
#include "core/common/types.h"
#include "polyest/density.h"

namespace polyest::internal {

class Expansion {
 public:
  // `coefficients` is S × m.
  Expansion(std::shared_ptr<const Basis> basis, Matrix coefficients);

  const Basis& basis() const { return *basis_; }
  const Matrix& coefficients() const { return coefficients_; }
  Vector Mean() const;
  Vector StandardDeviation() const;
  Vector Evaluate(const ConstVectorRef& xi) const;
  // Returns the values (count × m) at low-discrepancy draws of the germs, which depend on `count`
  // only.
  Matrix Sample(int count) const;

 private:
  std::shared_ptr<const Basis> basis_;
  Matrix coefficients_;
};

// Returns the normalized histogram of finite samples; one bin of unit width if they do not vary.
DensityEstimate DensityOfSamples(const ConstVectorRef& samples, int bins);
// Returns the empirical quantile by linear interpolation of the order statistics, 0 ≤ probability
// ≤ 1. The samples must be in increasing order.
double QuantileOfSorted(const ConstVectorRef& sorted, double probability);

}  // namespace polyest::internal
