#pragma once

// The noise of a measured output, as far as it is known beforehand.

#include <algorithm>
#include <cmath>

namespace polyest {

// How the noise of an output's samples is correlated in time: e_k, in units of its standard
// deviation, is white to the share f of its variance, and for the rest first-order autoregressive
// (an Ornstein–Uhlenbeck process at the sample times),
//   corr(e_k, e_j) = (1 − f) exp(−|t_k − t_j|/τ) for k ≠ j.
// With f = 0 it is first-order autoregressive alone.
enum class NoiseCorrelation {
  kWhite,    // none
  kKnown,    // τ = time_constant_s and f = white_share
  kUnknown,  // τ and f from the residuals; white until they show otherwise
};

// What is done about gross errors: a sample's noise variance is divided by a weight, a function of
// its residual u in units of the noise. While the samples of known noise are few (64, or 8 for each
// parameter), the density behind the weight is their likelihood instead. With
// LikelihoodForm::kPredictionError kStudentT is the noise's own distribution, t with 4 degrees of
// freedom scaled by σ, and kHuber is not available.
enum class OutlierHandling {
  kNone,      // the weight is 1
  kStudentT,  // (ν + 1)/(ν + u²), ν = 4: gross errors have almost no influence
  kHuber,     // min(1, 1.345/|u|): gross errors keep a bounded influence
};

// Standard deviation of the noise of one sample z:
//   σ = absolute + relative·max(|z|, 10⁻⁴ max|z|) + relative_to_max·max|z|,
// the maximum over the output's samples up to and including this one in time order, so that how
// samples are cut into batches does not matter. A known full scale takes the place of the last
// term's maximum. Samples of 0 before any other, to which neither `absolute` nor a full scale gives
// a σ above 0, are not used. If the part proportional to |z| is taken of the sample, samples that
// happen to be small count too much: an adaptive expansion takes it of the model's prediction in
// place of z, unless the noise is correlated. While there are few samples, it is that of the
// prediction for each value of the parameters, with the likelihood that belongs to it; later it is
// that of the prediction at the estimate. Where outliers are handled, it is so as soon as there is
// an estimate. If the size of the noise is unknown, a factor of σ is estimated; without numbers σ
// is then 1.
struct NoiseModel {
  // None of the parts may be above 10⁵⁰, or below 10⁻⁵⁰ unless it is 0.
  double absolute = 0;         // ≥ 0, in the output's unit
  double relative = 0;         // ≥ 0, of |z|
  double relative_to_max = 0;  // ≥ 0, of max |z| or of the full scale
  bool unknown = false;        // whether a factor of σ is estimated from the samples
  NoiseCorrelation correlation = NoiseCorrelation::kWhite;  // in time
  double time_constant_s = 0;  // τ > 0 when the correlation is known, else 0
  OutlierHandling outliers = OutlierHandling::kNone;  // what is done about gross errors
  double full_scale = 0;                              // ≥ 0, in the output's unit; 0: not known
  double least = 0;                                   // ≥ 0, the least σ, in the output's unit
  // f, 0 ≤ f < 1: the share of the variance that is white when the correlation is known. A sensor's
  // noise on top of a model's slow error has both parts.
  double white_share = 0;

  // The least magnitude that counts in `relative`, as a fraction of max |z|: samples at the zeros
  // of a signal are not arbitrarily accurate.
  static constexpr double kMinMagnitude = 1e-4;

  // Returns σ of a sample z. `largest_magnitude`: max |z| so far, this sample included.
  double StandardDeviation(double z, double largest_magnitude) const {
    if (unknown && absolute == 0 && relative == 0 && relative_to_max == 0) return 1;
    const double magnitude = std::max(std::abs(z), kMinMagnitude * largest_magnitude);
    const double scale = full_scale > 0 ? full_scale : largest_magnitude;
    return std::max(least, absolute + relative * magnitude + relative_to_max * scale);
  }
};

}  // namespace polyest
