#pragma once

// The distribution of a new sample: a mixture of the noise's densities around the predictions of
// posterior draws,
//   p(z) = (1/D) Σ_d k((z − y_d)/s_d)/s_d.

#include <vector>

#include "core/common/types.h"

namespace polyest::internal {

// The density k of the noise in units of its scale.
enum class NoiseKernel {
  kNormal,    // standard normal
  kStudentT,  // t with 4 degrees of freedom
};

class PredictiveDensity {
 public:
  // Takes predictions y (D ≥ 1, finite) and scales s (D, > 0), which must outlive it.
  PredictiveDensity(NoiseKernel kernel, const ConstVectorRef& y, const ConstVectorRef& s)
      : kernel_(kernel), y_(y), s_(s) {}

  double Mean() const;
  double StandardDeviation() const;
  double Density(double z) const;
  double LogDensity(double z) const;  // also where the density underflows
  double Cumulative(double z) const;
  // Returns z with Cumulative(z) = p, 0 < p < 1, to 10⁻⁶ of the standard deviation.
  double Quantile(double p) const;

 private:
  NoiseKernel kernel_;
  ConstVectorRef y_, s_;
};

// Returns 0 … count − 1 in an order without relation to that of draws. count ≥ 1.
std::vector<Eigen::Index> ScatteredOrder(int count);

// Returns `count` values of √(ν/χ²_ν) at evenly spaced probabilities in scattered order: the
// posterior of a noise's scale that was estimated from ν > 0 degrees of freedom, in units of the
// estimate. ν below 2 counts as 2.
Vector ScaleFactors(double degrees_of_freedom, int count);

}  // namespace polyest::internal
