#pragma once

// The weights of samples whose noise has outliers (polyest/noise.h).

#include <algorithm>
#include <cmath>

#include "polyest/noise.h"

namespace polyest::internal {

inline constexpr double kStudentTDegreesOfFreedom = 4;  // ν of OutlierHandling::kStudentT
inline constexpr double kHuberThreshold = 1.345;

// Returns the weight of a sample whose residual is u, in (0, 1.25].
inline double OutlierWeight(OutlierHandling outliers, double u) {
  switch (outliers) {
    case OutlierHandling::kNone:
      return 1;
    case OutlierHandling::kStudentT:
      return (kStudentTDegreesOfFreedom + 1) / (kStudentTDegreesOfFreedom + u * u);
    case OutlierHandling::kHuber:
      return std::abs(u) > kHuberThreshold ? kHuberThreshold / std::abs(u) : 1;
  }
  return 1;
}

// Returns the factor of a sample's variance. Reweighting keeps neither the variance of an estimate
// nor the sum of squares as they are in plain least squares. With Gaussian noise, and R =
// VarianceFactor·σ²/w for a sample,
//   Σ c cᵀ/R is the inverse of the asymptotic covariance E[ψ²]/E[ψ′]², ψ = w u,
//   Σ e²/R is DegreesFactor·N in the mean
// (Huber, Robust Statistics, 1981, §3.2; the numbers by quadrature over the normal density).
inline double VarianceFactor(OutlierHandling outliers) {
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

inline double DegreesFactor(OutlierHandling outliers) {
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

// A sample of less weight counts as an outlier: |u| > √6 for Student's t, |u| > 2.69 for Huber.
inline constexpr double kOutlierWeight = 0.5;

// Returns DegreesFactor for the samples that are no outliers, E[w u² | no outlier]/VarianceFactor.
// How many gross errors there are and how large nobody knows, so that no χ² of all samples can be
// expected, but the others have a truncated normal distribution whatever the outliers are.
inline double InlierDegreesFactor(OutlierHandling outliers) {
  switch (outliers) {
    case OutlierHandling::kNone:
      return 1;
    case OutlierHandling::kStudentT:
      return 0.6593814001;
    case OutlierHandling::kHuber:
      return 0.7900518225;
  }
  return 1;
}

// Returns what an outlier counts in the χ² from which a scale is learned, in place of
// w u²/VarianceFactor: a constant, since the scale would grow with the gross errors otherwise. For
// Student's t it is the mean of w u² over that distribution, 1. To Huber's estimate gross errors
// keep an influence ψ² = k², which the variance of the estimate has to have: so ψ² is what counts,
// as in his proposal 2 (Robust Statistics, 1981, §6.4). Either way the scale grows with the number
// of gross errors by about what they take from the information: with up to 20 % of them the
// standard deviation of an estimate is 0.93 to 1.01 of that of the asymptotic theory.
inline double OutlierDegrees(OutlierHandling outliers) {
  switch (outliers) {
    case OutlierHandling::kNone:
      return 1;
    case OutlierHandling::kStudentT:
      return 1 / VarianceFactor(outliers);
    case OutlierHandling::kHuber:
      return kHuberThreshold * kHuberThreshold / VarianceFactor(outliers);
  }
  return 1;
}

// Returns DegreesFactor for samples of which outliers count OutlierDegrees.
inline double BoundedDegreesFactor(OutlierHandling outliers) {
  // P(|u| > √6) and P(|u| > 2.69)
  const double share = outliers == OutlierHandling::kStudentT ? 0.0143060669
                       : outliers == OutlierHandling::kHuber  ? 0.0071452019
                                                              : 0;
  return (1 - share) * InlierDegreesFactor(outliers) + share * OutlierDegrees(outliers);
}

// Returns −log of the density behind the weight, ρ with ρ′(u) = OutlierWeight(u) u, up to a
// constant: ½ (ν + 1) log(1 + u²/ν) for Student's t, k |u| − ½ k² for Huber where |u| > k and ½ u²
// elsewhere.
inline double RobustLoss(OutlierHandling outliers, double u) {
  switch (outliers) {
    case OutlierHandling::kNone:
      return 0.5 * u * u;
    case OutlierHandling::kStudentT:
      return 0.5 * (kStudentTDegreesOfFreedom + 1) * std::log1p(u * u / kStudentTDegreesOfFreedom);
    case OutlierHandling::kHuber: {
      const double inner = std::min(std::abs(u), kHuberThreshold);
      return inner * (std::abs(u) - 0.5 * inner);
    }
  }
  return 0.5 * u * u;
}

// Returns ρ″(u), which is below 0 for Student's t where u² > ν.
inline double RobustCurvature(OutlierHandling outliers, double u) {
  switch (outliers) {
    case OutlierHandling::kNone:
      return 1;
    case OutlierHandling::kStudentT: {
      const double sum = kStudentTDegreesOfFreedom + u * u;
      const double difference = kStudentTDegreesOfFreedom - u * u;
      return (kStudentTDegreesOfFreedom + 1) * (difference / sum) / sum;
    }
    case OutlierHandling::kHuber:
      return std::abs(u) > kHuberThreshold ? 0 : 1;
  }
  return 1;
}

// Returns −log of the density at 0 less that of the normal density: what ρ(u) + ½ log 2π lacks to
// be −log of the density.
inline double LackOfDensity(OutlierHandling outliers) {
  switch (outliers) {
    case OutlierHandling::kNone:
      return 0;
    case OutlierHandling::kStudentT:
      return 0.0618907198;  // −log(3/8 · √(2π))
    case OutlierHandling::kHuber:
      return 0.0596596614;  // log ∫ e^{−ρ(u)} du/√(2π)
  }
  return 0;
}

// Returns −log of the density behind the weight minus ½ OutlierWeight(u) u², at u and up to a
// constant.
inline double LackOfWeight(OutlierHandling outliers, double u) {
  return RobustLoss(outliers, u) - 0.5 * OutlierWeight(outliers, u) * u * u;
}

// Where filters take the samples (core/propagation/heavy_tail.h), Student's t is not weighed but
// has its likelihood ½ w², w² = (ν + 1) log(1 + u²/ν) for states that are known. What follows is of
// w.

// E[w²] = (ν + 1) (ψ(½ν + ½) − ψ(½ν)) for noise of this kind.
inline constexpr double kFilteredDegreesFactor = 1.4018615;

// Returns the weight that a sample would have.
inline double FilteredOutlierWeight(double w) {
  return (1 + 1 / kStudentTDegreesOfFreedom) * std::exp(-w * w / (kStudentTDegreesOfFreedom + 1));
}

// Returns whether any property of the noise is to be learned from the record.
inline bool IsLearned(const NoiseModel& noise) {
  return noise.unknown || noise.correlation == NoiseCorrelation::kUnknown ||
         noise.outliers != OutlierHandling::kNone;
}

// Returns whether the noise depends on the value that is measured, so that it should be that of the
// prediction. Correlated samples are combined with their noise before there are predictions.
inline bool IsOfPrediction(const NoiseModel& noise) {
  return noise.relative > 0 && noise.correlation == NoiseCorrelation::kWhite;
}

}  // namespace polyest::internal
