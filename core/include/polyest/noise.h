#pragma once

// The noise of a measured output, as far as it is known beforehand.

#include <algorithm>
#include <cmath>

namespace polyest {

// How the noise of an output's samples is correlated in time: e_k, in units of its standard
// deviation, is first-order autoregressive (an Ornstein–Uhlenbeck process at the sample times),
//   corr(e_k, e_j) = exp(−|t_k − t_j|/τ).
enum class NoiseCorrelation {
  kWhite,    // none
  kKnown,    // τ = time_constant_s
  kUnknown,  // τ from the residuals; white until they show otherwise
};

// What is done about gross errors: a sample's noise variance is divided by a weight, a function of
// its residual u in units of the noise.
enum class OutlierHandling {
  kNone,      // the weight is 1
  kStudentT,  // (ν + 1)/(ν + u²), ν = 4: gross errors have almost no influence
  kHuber,     // min(1, 1.345/|u|): gross errors keep a bounded influence
};

// Standard deviation of the noise of one sample z:
//   σ = max(10⁻⁶, absolute + relative·|z| + relative_to_max·max|z|),
// the maximum over the output's samples up to and including this one in time order, so that how
// samples are cut into batches does not matter. If the size of the noise is unknown, a factor of σ
// is estimated; without numbers σ is then 1.
struct NoiseModel {
  double absolute = 0;         // ≥ 0, in the output's unit
  double relative = 0;         // ≥ 0, of |z|
  double relative_to_max = 0;  // ≥ 0, of max |z|
  bool unknown = false;        // whether a factor of σ is estimated from the samples
  NoiseCorrelation correlation = NoiseCorrelation::kWhite;  // in time
  double time_constant_s = 0;                               // τ > 0 when the correlation is known
  OutlierHandling outliers = OutlierHandling::kNone;        // what is done about gross errors

  // The least σ, in the output's unit.
  static constexpr double kMinStandardDeviation = 1e-6;

  // Returns σ of a sample z. `largest_magnitude`: max |z| so far, this sample included.
  double StandardDeviation(double z, double largest_magnitude) const {
    if (unknown && absolute == 0 && relative == 0 && relative_to_max == 0) return 1;
    return std::max(kMinStandardDeviation,
                    absolute + relative * std::abs(z) + relative_to_max * largest_magnitude);
  }
};

}  // namespace polyest
