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
  if (problem_.uses_filters()) {
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

// Adds a weighted sample's density at the centre. `noise` is σ² without the weight, `variance` is R
// as in the sums, and `lack` what its weight leaves out of the likelihood.
void RegionalExpansion::AddToDensity(int channel, const ConstVectorRef& coefficients, double z,
                                     double noise, double own_error, double variance, double lack) {
  OutlierDensity& density = absorbed_.densities[static_cast<size_t>(channel)];
  if (density.outliers() == OutlierHandling::kNone) return;
  const double all = noise + own_error;
  const double normalized = VarianceFactor(density.outliers()) * noise + own_error;
  density.Add((z - coefficients.dot(centre_phi_)) / std::sqrt(all), all / variance,
              0.5 * std::log(normalized / all) + lack);
}

const OutlierDensity* RegionalExpansion::DensityOfWeighted(int channel) const {
  const OutlierDensity& density = absorbed_.densities[static_cast<size_t>(channel)];
  if (density.outliers() == OutlierHandling::kNone || KeptSamples(channel)) return nullptr;
  return &density;
}

Vector RegionalExpansion::CentreOfWeights() const {
  const Vector& centre = noise_.posterior.centre;
  return centre.size() == 0 ? design_.reference : design_.region.ToLocal(centre);
}

}  // namespace polyest::internal
