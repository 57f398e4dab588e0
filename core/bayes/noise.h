#pragma once

// The noise of a measured channel: what the problem says of it, and what the record has taught.

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace polyest {

// How the noise of a channel's samples hangs together in time: e_k, in units of its standard
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
  kNone,
  kStudentT,  // (ν + 1)/(ν + u²), ν = 4: gross errors lose their say altogether
  kHuber,     // min(1, 1.345/|u|): they keep a bounded one
};

// Standard deviation of the noise of one sample z:
//   σ = max(10⁻⁶, absolute + relative·|z| + relative_to_max·max|z|),
// the maximum over the channel's samples up to and including this one in time order, so that how
// samples are cut into batches does not matter. When its size is unknown, σ times a factor to be
// estimated; without numbers σ is then 1.
struct NoiseModel {
  double absolute = 0;         // in the output's unit
  double relative = 0;         // of |z|
  double relative_to_max = 0;  // of max |z|
  bool unknown = false;
  NoiseCorrelation correlation = NoiseCorrelation::kWhite;
  double time_constant_s = 0;  // > 0 when the correlation is known
  OutlierHandling outliers = OutlierHandling::kNone;

  static constexpr double kLeastStandardDeviation = 1e-6;
  static constexpr double kDegreesOfFreedom = 4;  // ν of kStudentT
  static constexpr double kHuberThreshold = 1.345;

  double StandardDeviation(double z, double largest_magnitude) const {
    if (unknown && absolute == 0 && relative == 0 && relative_to_max == 0) return 1;
    return std::max(kLeastStandardDeviation,
                    absolute + relative * std::abs(z) + relative_to_max * largest_magnitude);
  }

  // Of a sample whose residual is u, in (0, 1.25].
  double Weight(double u) const {
    switch (outliers) {
      case OutlierHandling::kNone:
        return 1;
      case OutlierHandling::kStudentT:
        return (kDegreesOfFreedom + 1) / (kDegreesOfFreedom + u * u);
      case OutlierHandling::kHuber:
        return std::abs(u) > kHuberThreshold ? kHuberThreshold / std::abs(u) : 1;
    }
    return 1;
  }

  // Reweighting keeps neither the variance of an estimate nor the sum of squares what they are for
  // plain least squares. With Gaussian noise, and R = VarianceFactor·σ²/w for a sample,
  //   Σ c cᵀ/R is the inverse of the asymptotic covariance E[ψ²]/E[ψ′]², ψ = w u,
  //   Σ e²/R is DegreesFactor·N in the mean
  // (Huber, Robust Statistics, 1981, §3.2; the numbers by quadrature over the normal density).
  double VarianceFactor() const {
    switch (outliers) {
      case OutlierHandling::kNone:
        return 1;
      case OutlierHandling::kStudentT:
        return 1.1377756688;
      case OutlierHandling::kHuber:
        return 1.0104154703;
    }
    return 1;
  }
  double DegreesFactor() const {
    switch (outliers) {
      case OutlierHandling::kNone:
        return 1;
      case OutlierHandling::kStudentT:
        return 0.6910920392;
      case OutlierHandling::kHuber:
        return 0.8129079479;
    }
    return 1;
  }

  // What ½ Weight(u) u² lacks of −log of the density behind the weight, at u and up to a constant:
  // of the t density ½ (ν + 1) log(1 + u²/ν), of Huber's k |u| − ½ k² where |u| > k and ½ u² else.
  double LackOfWeight(double u) const {
    switch (outliers) {
      case OutlierHandling::kNone:
        return 0;
      case OutlierHandling::kStudentT:
        return 0.5 * (kDegreesOfFreedom + 1) * std::log1p(u * u / kDegreesOfFreedom) -
               0.5 * Weight(u) * u * u;
      case OutlierHandling::kHuber:
        return 0.5 * kHuberThreshold * std::max(0.0, std::abs(u) - kHuberThreshold);
    }
    return 0;
  }

  // Whether anything of it is to be learned from the record.
  bool Learns() const {
    return unknown || correlation == NoiseCorrelation::kUnknown ||
           outliers != OutlierHandling::kNone;
  }
};

}  // namespace polyest
