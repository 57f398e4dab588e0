// Which samples are outliers, and what they add to χ² (bayes/noise.h).

#include <cmath>

#include "core/bayes/noise.h"
#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {

double RegionalExpansion::DeviationFromCentre(const WeightedSample& sample) const {
  if (sample.model->outliers == OutlierHandling::kNone) return 0;
  const auto coefficients = CoefficientsOf(sample);
  const double error = sample.value - coefficients.dot(centre_phi_);
  const double variance = sample.sigma * sample.sigma + sample.own_error;
  const double open = (spread_.transpose() * coefficients).squaredNorm();
  return error / std::sqrt(variance + open);
}

// Counts the sample if it is an outlier, whose part of χ² is taken for expected. Its variance is R
// as in the sums: where gross errors are large, the posterior's spread, which only the weight has,
// is not negligible in their part.
void RegionalExpansion::CountOutlier(const WeightedSample& sample) {
  const auto c = static_cast<size_t>(sample.channel);
  if (problem_.uses_filters()) {
    const bool tailed =
        IsTailed(sample.channel) && FilteredOutlierWeight(sample.deviation) < kOutlierWeight;
    if (tailed) ++absorbed_.outliers[c];
    return;
  }
  if (OutlierWeight(sample.outliers, sample.deviation) >= kOutlierWeight) return;
  ++absorbed_.outliers[c];
  const double error = sample.value - CoefficientsOf(sample).dot(centre_phi_);
  absorbed_.sums[c].surplus += error * error / sample.variance() - OutlierDegrees(sample.outliers);
}

// Adds a weighted sample's density at the centre.
void RegionalExpansion::AddToDensity(const WeightedSample& sample) {
  OutlierDensity& density = absorbed_.densities[static_cast<size_t>(sample.channel)];
  if (density.outliers() == OutlierHandling::kNone) return;
  const double noise = sample.sigma * sample.sigma;
  const double all = noise + sample.own_error;
  const double normalized = VarianceFactor(density.outliers()) * noise + sample.own_error;
  density.Add((sample.value - CoefficientsOf(sample).dot(centre_phi_)) / std::sqrt(all),
              all / sample.variance(), 0.5 * std::log(normalized / all) + sample.lack);
}

const OutlierDensity* RegionalExpansion::DensityOfWeighted(int channel) const {
  const OutlierDensity& density = absorbed_.densities[static_cast<size_t>(channel)];
  if (density.outliers() == OutlierHandling::kNone || absorbed_.KeptSamples(channel))
    return nullptr;
  return &density;
}

Vector RegionalExpansion::CentreOfWeights() const {
  const Vector& centre = noise_.posterior.centre;
  return centre.size() == 0 ? design_.reference : design_.region.ToLocal(centre);
}

}  // namespace polyest::internal
