// The likelihood of the samples of channels with outliers or relative noise while they are few
// (bayes/robust_samples.h, bayes/relative_samples.h).

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
constexpr int64_t kMaxKept = 64, kMaxKeptPerParameter = 8;
// The same for channels of relative noise, which must also have left the minima that few samples of
// large noise make.
constexpr int64_t kMaxKeptRelative = 256;

// Returns the number of samples that are kept.
template <class Samples>
int64_t CountOf(const std::vector<Samples>& channels) {
  return std::accumulate(channels.begin(), channels.end(), int64_t{0},
                         [](int64_t sum, const Samples& samples) { return sum + samples.count(); });
}

}  // namespace

// Whether the noise of a channel is relative to the predictions, so that its samples are kept. A
// scale that has not been learned is far too large to tell anything of the predictions.
bool RegionalExpansion::IsKeptRelative(int channel) const {
  const NoiseModel& model = ModelOf(channel);
  return problem_.problem().expansion.adaptive && IsOfPrediction(model) &&
         model.outliers == OutlierHandling::kNone &&
         (!model.unknown || noise_.channels[static_cast<size_t>(channel)].learned);
}

// Begins to keep the samples of channels with outliers whose noise is known, and of those with
// relative noise. Ended runs have left their sums alone.
void RegionalExpansion::KeepFewSamples() {
  if (problem_.uses_filters() || problem_.ended_runs() != nullptr) return;
  SampleBySample few;
  bool any = false;
  for (int c = 0; c < channels_; ++c) {
    const NoiseModel& model = ModelOf(c);
    const bool known = !model.unknown && model.correlation != NoiseCorrelation::kUnknown;
    const OutlierHandling outliers = known ? model.outliers : OutlierHandling::kNone;
    few.channels.emplace_back(outliers, design_.basis->size());
    few.relative.emplace_back(IsKeptRelative(c), design_.basis->size());
    any = any || outliers != OutlierHandling::kNone || IsKeptRelative(c);
  }
  if (!any) return;
  few.check_chi_squared = absorbed_.check_chi_squared;
  few.check_residual = absorbed_.check_residual;
  few.point_chi_squared = absorbed_.point_chi_squared;
  few.check_log_variance.setZero(few.check_chi_squared.rows(), channels_);
  few.point_log_variance.setZero(few.point_chi_squared.rows(), channels_);
  few.largest.setZero(channels_);
  absorbed_.few = std::move(few);
}

// Adds a sample after the sums have got it, which are what counts for a channel whose samples are
// not kept.
void RegionalExpansion::AddToFew(const WeightedSample& sample) {
  if (absorbed_.KeptRelative(sample.channel)) {
    AddRelative(sample);
  } else {
    AddRobust(sample);
  }
  const SampleBySample& few = *absorbed_.few;
  const int64_t most = std::max<int64_t>(kMaxKept, kMaxKeptPerParameter * problem_.dimension());
  if (CountOf(few.channels) > most || CountOf(few.relative) > std::max(most, kMaxKeptRelative)) {
    absorbed_.few.reset();
  }
}

// Adds a sample of relative noise. R⁰ is the variance at the prediction about which residuals are
// linearized.
void RegionalExpansion::AddRelative(const WeightedSample& sample) {
  SampleBySample& few = *absorbed_.few;
  const int channel = sample.channel, column = sample.column;
  const double own_error = sample.own_error;
  const auto coefficients = CoefficientsOf(sample);
  const double z = block_.Value(sample.row, channel);  // not scored
  few.largest[channel] = std::max(few.largest[channel], std::abs(z));
  const auto deviation = RelativeDeviation::Of(*sample.model, few.largest[channel],
                                               noise_.channels[static_cast<size_t>(channel)].scale);
  const double sigma = deviation.At(coefficients.dot(linearized_phi_));
  const double reference = sigma * sigma + own_error;
  few.log_noise += std::log(sigma);
  few.log_variance += 0.5 * std::log(reference);
  few.own_error += block_.residual_variance[column] / reference + absorbed_.carried_rate;
  for (int i = 0; i < trajectories_.checks(); ++i) {
    if (!absorbed_.check_valid[static_cast<size_t>(i)]) continue;
    const double y = block_.outputs(points() + i, column);
    const double difference = y - block_.check_predictions(i, column);
    const double variance = deviation.At(y) * deviation.At(y);
    few.check_chi_squared(i, channel) += (z - y) * (z - y) / variance;
    few.check_log_variance(i, channel) += std::log(variance / (sigma * sigma));
    few.check_residual[i] += difference * difference / variance;
  }
  for (Eigen::Index q = 0; q < points(); ++q) {
    const double y = block_.outputs(q, column);
    const double variance = deviation.At(y) * deviation.At(y) + own_error;
    few.point_chi_squared(q, channel) += (z - y) * (z - y) / variance;
    few.point_log_variance(q, channel) += std::log(variance / reference);
  }
  few.relative[static_cast<size_t>(channel)].Add(coefficients, z, coefficients.dot(reference_phi_),
                                                 deviation, own_error, reference);
}

// The normalization of weighted samples is that of the sums (Normalize); kept ones have no weight.
void RegionalExpansion::AddRobust(WeightedSample sample) {
  SampleBySample& few = *absorbed_.few;
  RobustSamples& kept = few.channels[static_cast<size_t>(sample.channel)];
  const OutlierHandling outliers = kept.outliers();
  double normal = VarianceFactor(sample.outliers) * sample.sigma * sample.sigma;
  if (outliers != OutlierHandling::kNone) {
    sample.noise = normal = sample.sigma * sample.sigma;
    sample.lack = LackOfDensity(outliers);
  }
  const int channel = sample.channel, column = sample.column;
  const double z = sample.value, variance = sample.variance();
  few.log_noise += 0.5 * std::log(normal) + sample.lack;
  few.log_variance += 0.5 * std::log(normal + sample.own_error) + sample.lack;
  few.own_error += block_.residual_variance[column] / variance + absorbed_.carried_rate;
  const auto chi_squared = [&](double y, double scale) {
    return 2 * RobustLoss(outliers, (z - y) / std::sqrt(scale));
  };
  for (int i = 0; i < trajectories_.checks(); ++i) {
    if (!absorbed_.check_valid[static_cast<size_t>(i)]) continue;
    const double y = block_.outputs(points() + i, column);
    const double difference = y - block_.check_predictions(i, column);
    few.check_chi_squared(i, channel) += chi_squared(y, sample.noise);
    few.check_residual[i] += difference * difference / sample.noise;
  }
  for (Eigen::Index q = 0; q < points(); ++q) {
    few.point_chi_squared(q, channel) += chi_squared(block_.outputs(q, column), variance);
  }
  if (outliers == OutlierHandling::kNone) return;
  const auto coefficients = CoefficientsOf(sample);
  kept.Add(coefficients, z - coefficients.dot(reference_phi_), variance);
}

}  // namespace polyest::internal
