// Which samples are outliers, and what they add to χ² (bayes/noise.h).

#include <cmath>

#include "core/bayes/noise.h"
#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {

// Returns the deviation of the sample in units of its possible error there, or 0 if outliers are
// not handled. `variance` is that of the sample about the expansion.
double RegionalExpansion::DeviationFromCentre(int channel, const ConstVectorRef& coefficients,
                                              double z, double variance) const {
  const NoiseModel& model = problem_.problem().measured[static_cast<size_t>(channel)].noise;
  if (model.outliers == OutlierHandling::kNone) return 0;
  const double error = z - coefficients.dot(centre_phi_);
  const double open = (spread_.transpose() * coefficients).squaredNorm();
  return error / std::sqrt(variance + open);
}

// Counts the sample if it is an outlier, whose part of χ² is taken for expected. `variance` is R as
// in the sums: where gross errors are large, the posterior's spread, which only the weight has, is
// not negligible in their part.
void RegionalExpansion::CountOutlier(int channel, const ConstVectorRef& coefficients, double z,
                                     double variance, double deviation) {
  const auto c = static_cast<size_t>(channel);
  if (filters_) {
    const bool tailed = IsTailed(channel) && FilteredOutlierWeight(deviation) < kOutlierWeight;
    if (tailed) ++absorbed_.outliers[c];
    return;
  }
  const OutlierHandling outliers = problem_.problem().measured[c].noise.outliers;
  if (OutlierWeight(outliers, deviation) >= kOutlierWeight) return;
  ++absorbed_.outliers[c];
  const double error = z - coefficients.dot(centre_phi_);
  absorbed_.sums[c].surplus += error * error / variance - OutlierDegrees(outliers);
}

}  // namespace polyest::internal
