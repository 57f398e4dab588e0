// Which samples are outliers, what they add to χ² (bayes/noise.h), and their likelihood while they
// are few (bayes/robust_samples.h).

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/bayes/noise.h"
#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {
namespace {

// Samples of channels with outliers up to which each is kept, or as many for each parameter. With
// more of them the posterior is so narrow that the weights do not change over it.
constexpr int64_t kMostKept = 64, kMostKeptPerParameter = 8;

}  // namespace

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

const RobustSamples* RegionalExpansion::KeptSamples(int channel) const {
  if (!absorbed_.few) return nullptr;
  const RobustSamples& samples = absorbed_.few->channels[static_cast<size_t>(channel)];
  return samples.outliers() == OutlierHandling::kNone ? nullptr : &samples;
}

int64_t RegionalExpansion::MaxKeptSamples() const {
  return std::max<int64_t>(kMostKept, kMostKeptPerParameter * problem_.dimension());
}

// Begins to keep the samples of channels with outliers whose noise is known. Ended runs have left
// their weighted sums alone.
void RegionalExpansion::KeepFewSamples() {
  if (problem_.uses_filters() || problem_.ended_runs() != nullptr) return;
  SampleBySample few;
  bool any = false;
  for (const MeasuredOutput& measured : problem_.problem().measured) {
    const NoiseModel& model = measured.noise;
    const bool known = !model.unknown && model.correlation != NoiseCorrelation::kUnknown;
    const OutlierHandling outliers = known ? model.outliers : OutlierHandling::kNone;
    few.channels.emplace_back(outliers, design_.basis->size());
    any = any || outliers != OutlierHandling::kNone;
  }
  if (!any) return;
  few.check_chi_squared = absorbed_.check_chi_squared;
  few.check_residual = absorbed_.check_residual;
  few.point_chi_squared = absorbed_.point_chi_squared;
  absorbed_.few = std::move(few);
}

// Adds a sample after the sums have got it. `z`, its variance `noise` and `lack` are as in the
// sums, which are what counts for a channel whose samples are not kept.
void RegionalExpansion::AddToFew(int channel, int column, double z, double noise, double lack) {
  SampleBySample& few = *absorbed_.few;
  RobustSamples& kept = few.channels[static_cast<size_t>(channel)];
  const OutlierHandling outliers = kept.outliers();
  const double sigma = block_.rows.noise[static_cast<size_t>(column)];
  // The normalization of weighted samples is that of the sums (Normalize).
  const NoiseModel& model = problem_.problem().measured[static_cast<size_t>(channel)].noise;
  double normal = VarianceFactor(model.outliers) * sigma * sigma;
  if (outliers != OutlierHandling::kNone) {
    noise = normal = sigma * sigma;
    lack = LackOfDensity(outliers);
  }
  const double own_error = block_.residual_variance[column] / noise_.misfit_of_weights;
  const double variance = noise + own_error;
  few.log_noise += 0.5 * std::log(normal) + lack;
  few.log_variance += 0.5 * std::log(normal + own_error) + lack;
  few.own_error += block_.residual_variance[column] / variance + absorbed_.carried_rate;
  const auto chi_squared = [&](double y, double scale) {
    return 2 * RobustLoss(outliers, (z - y) / std::sqrt(scale));
  };
  for (int i = 0; i < trajectories_.checks(); ++i) {
    if (!absorbed_.check_valid[static_cast<size_t>(i)]) continue;
    const double y = block_.outputs(points() + i, column);
    const double difference = y - block_.check_predictions(i, column);
    few.check_chi_squared(i, channel) += chi_squared(y, noise);
    few.check_residual[i] += difference * difference / noise;
  }
  for (Eigen::Index q = 0; q < points(); ++q) {
    few.point_chi_squared(q, channel) += chi_squared(block_.outputs(q, column), variance);
  }
  if (outliers == OutlierHandling::kNone) return;
  const auto coefficients = block_.coefficients.col(column);
  kept.Add(coefficients, z - coefficients.dot(reference_phi_), variance);
  const int64_t count = std::accumulate(
      few.channels.begin(), few.channels.end(), int64_t{0},
      [](int64_t sum, const RobustSamples& samples) { return sum + samples.count(); });
  if (count > MaxKeptSamples()) absorbed_.few.reset();
}

}  // namespace polyest::internal
