#include <algorithm>
#include <cmath>

#include "core/bayes/noise.h"
#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {

// Residuals are linearized about the point at which the noise was last revised.
void RegionalExpansion::Linearize() {
  const Eigen::Index n = design_.points.cols();
  linearized_at_ =
      noise_.centre.size() == n ? design_.region.ToLocal(noise_.centre) : design_.reference;
  linearized_phi_.resize(design_.basis->size());
  linearized_gradient_.resize(design_.basis->size(), n);
  slope_.resize(n);
  design_.basis->EvaluateWithGradient(linearized_at_, linearized_phi_, linearized_gradient_);
  absorbed_.blocks.assign(noise_.channels.size(), ResidualBlocks(n));
  for (size_t c = 0; c < noise_.channels.size(); ++c) {
    const ChannelNoise& noise = noise_.channels[c];
    if (noise.grid.empty()) continue;
    absorbed_.profiles[c] = CorrelationProfile(noise.grid, noise.shape(), n);
  }
}

// Sets the noise of the block's fitted rows to that of the prediction, where it is relative. Such a
// channel is white, so that its rows are as they were measured.
void RegionalExpansion::PredictNoise() {
  for (int c = 0; c < channels_; ++c) {
    const ChannelNoise& noise = noise_.channels[static_cast<size_t>(c)];
    if (!noise.of_prediction) continue;
    const NoiseModel& model = ModelOf(c);
    for (int row = 0; row < block_.fitted_rows; ++row) {
      const int column = block_.Column(row, c);
      double& sigma = block_.rows.noise[static_cast<size_t>(column)];
      if (sigma <= 0) continue;  // no sample
      double& largest = absorbed_.largest[c];
      largest = std::max(largest, std::abs(block_.Value(row, c)));
      const double y = block_.coefficients.col(column).dot(linearized_phi_);
      sigma = noise.scale * model.StandardDeviation(y, largest);
    }
  }
}

// Whether the samples of a channel tell of its predictions by their scatter, too: if their noise is
// relative to the prediction, and known. Outliers would say anything.
bool RegionalExpansion::IsScored(int channel) const {
  const NoiseModel& model = ModelOf(channel);
  return noise_.channels[static_cast<size_t>(channel)].of_prediction && !model.unknown &&
         model.outliers == OutlierHandling::kNone;
}

ScoredSample RegionalExpansion::Scored(const WeightedSample& sample) const {
  const NoiseModel& model = *sample.model;
  const double y = CoefficientsOf(sample).dot(linearized_phi_);
  // Where the least noise applies, σ does not change with y.
  const bool flat = sample.noise <= model.least * model.least;
  const double slope = flat ? 0 : std::copysign(model.relative, y) / std::sqrt(sample.noise);
  return Score(sample.value, y, sample.noise, slope, sample.own_error);
}

// What filters predict is not linear enough in the parameters of its variance.
void RegionalExpansion::AddToBlocks(const WeightedSample& sample) {
  if (problem_.uses_filters()) return;
  const auto coefficients = CoefficientsOf(sample);
  const double unit = 1 / std::sqrt(sample.variance());
  slope_.noalias() = unit * (linearized_gradient_.transpose() * coefficients);
  absorbed_.blocks[static_cast<size_t>(sample.channel)].Add(
      slope_, unit * (sample.value - coefficients.dot(linearized_phi_)));
}

// Adds a sample to the channel's likelihood for other time constants, if there is one.
void RegionalExpansion::AddToProfile(const WeightedSample& sample) {
  CorrelationProfile& profile = absorbed_.profiles[static_cast<size_t>(sample.channel)];
  if (profile.empty()) return;
  const auto coefficients = CoefficientsOf(sample);
  slope_.noalias() = (linearized_gradient_.transpose() * coefficients) / sample.sigma;
  // The whitening must be undone with the noise that it was done with; the weight comes after it.
  profile.Add(block_.Row(sample.row).time_s, slope_,
              (sample.value - coefficients.dot(linearized_phi_)) / sample.sigma,
              sample.sigma * sample.sigma / sample.variance());
}

}  // namespace polyest::internal
