#pragma once

// The prior of one uncertain parameter, as a map of a germ ξ:
//   normal, uniform, beta, gamma, truncated normal   θ = location + scale ξ
//   lognormal                                        θ = exp(location + scale ξ), ξ ~ N(0, 1)
//
// Lognormal, from its own mean m and standard deviation s:
//   scale² = log(1 + s²/m²),  location = log m − scale²/2.
// Estimates are modes of densities of ξ. That of an affine θ is the same; of a lognormal it is the
// θ whose logarithm is most likely: the prior's is e^location, the median, between mode and mean.

#include <absl/status/statusor.h>

#include <limits>
#include <string>

#include "core/chaos/germ.h"

namespace polyest {

enum class ParameterMap { kAffine, kExponential };

struct UncertainParameter {
  std::string name;
  Germ germ = Germ::Uniform();
  double location = 0;  // θ, or log θ, at ξ = 0
  double scale = 1;     // dθ/dξ, or d log θ/dξ, > 0
  ParameterMap map = ParameterMap::kAffine;
  bool per_run = false;  // each run of the record has a value of its own, all with this prior

  // INVALID_ARGUMENT names the parameter, the value and the rule.
  static absl::StatusOr<UncertainParameter> Normal(std::string name, double mean, double std_dev);
  static absl::StatusOr<UncertainParameter> Uniform(std::string name, double lower, double upper);
  static absl::StatusOr<UncertainParameter> Beta(std::string name, double alpha, double beta,
                                                 double lower, double upper);
  static absl::StatusOr<UncertainParameter> Gamma(std::string name, double shape, double scale,
                                                  double shift);
  // mean and std_dev of the quantity itself, 0 < std_dev ≤ 100 mean.
  static absl::StatusOr<UncertainParameter> Lognormal(std::string name, double mean,
                                                      double std_dev);
  // mean and std_dev of the normal density before it is cut to [lower, upper]; either bound may be
  // infinite. At least 10⁻⁶ of the normal's probability must lie between them.
  static absl::StatusOr<UncertainParameter> TruncatedNormal(
      std::string name, double mean, double std_dev,
      double lower = -std::numeric_limits<double>::infinity(),
      double upper = std::numeric_limits<double>::infinity());

  double ToParameter(double xi) const;
  double ToGerm(double theta) const;  // not a number for a θ ≤ 0 of a lognormal
  double Slope(double xi) const;      // dθ/dξ
  double Mean() const;                // of θ
  double StandardDeviation() const;   // of θ
};

}  // namespace polyest
