// What is expanded where the likelihood is that of prediction errors (regional_expansion.h).

#include <cmath>
#include <vector>

#include "core/common/status.h"
#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {

void RegionalExpansion::StartFilters(int run) {
  filters_ = std::make_unique<FilterBank>(
      problem_.MakeEnsemble(thetas_, problem_.outputs(), threads_, run), &inputs_->signals());
  StartControls(run);
}

// Takes rows of the block that are of the present run.
absl::Status RegionalExpansion::AdvanceFilters(int first, int count, const Stop& stop) {
  const size_t width = block_.values.size() / block_.rows.size();
  std::vector<double> times_s;
  Matrix values(channels_, count), noise(channels_, count);
  for (int k = 0; k < count; ++k) {
    const auto row = static_cast<size_t>(first + k);
    times_s.push_back(block_.rows[row].time_s);
    for (int c = 0; c < channels_; ++c) {
      const auto channel = static_cast<size_t>(c);
      values(c, k) = block_.values[row * width + channel];
      noise(c, k) = block_.noise[row * static_cast<size_t>(channels_) + channel];
    }
  }
  log_variances_.resize(outputs_.rows(), outputs_.cols());
  log_variance_coefficients_.resize(coefficients_.rows(), coefficients_.cols());
  log_variance_residual_.resize(residual_variance_.size());
  const FilterSamples samples{times_s, values, noise};
  auto innovations = outputs_.middleCols(first * channels_, count * channels_);
  auto variances = log_variances_.middleCols(first * channels_, count * channels_);
  POLYEST_RETURN_IF_ERROR(filters_->Advance(samples, innovations.topRows(thetas_.rows()),
                                            variances.topRows(thetas_.rows()), stop));
  if (controls_ > 0) {
    POLYEST_RETURN_IF_ERROR(control_filters_->Advance(samples, innovations.bottomRows(controls_),
                                                      variances.bottomRows(controls_), stop));
  }
  SubstituteInnovations(first, count);
  return absl::OkStatus();
}

// Replaces the whitened innovations w of the rows by z − σ w, of which they are the residuals in
// units of the noise. They stay 0 without a sample.
void RegionalExpansion::SubstituteInnovations(int first, int count) {
  const size_t width = block_.values.size() / block_.rows.size();
  for (int row = first; row < first + count; ++row) {
    for (int c = 0; c < channels_; ++c) {
      const double sigma = block_.noise[static_cast<size_t>(row * channels_ + c)];
      if (!(sigma > 0)) continue;
      const double z = block_.values[static_cast<size_t>(row) * width + static_cast<size_t>(c)];
      for (double& output : outputs_.col(row * channels_ + c)) output = z - sigma * output;
    }
  }
}

// Adds ½ log(S/σ²) of one sample, whose weight in the sums is 1/`variance` and not 1/`noise`.
void RegionalExpansion::AddLogVariance(int column, double noise, double variance) {
  const double weight = 0.5 * noise / variance;
  const int channel = column % channels_;
  ChannelSums& sums = absorbed_.sums[static_cast<size_t>(channel)];
  const auto coefficients = log_variance_coefficients_.col(column);
  sums.log_variance += weight * coefficients;
  sums.log_variance_at_reference += weight * coefficients.dot(reference_phi_);
  const auto values = log_variances_.col(column);
  absorbed_.point_log_variance += weight * values.head(points());
  absorbed_.point_chi_squared.col(channel) += 2 * weight * values.head(points());
  for (Eigen::Index i = 0; i < check_phi_.rows(); ++i) {
    if (!absorbed_.check_valid[static_cast<size_t>(i)]) continue;
    absorbed_.check_chi_squared(i, channel) += values[points() + i];
  }
}

std::optional<FilteredStates> RegionalExpansion::Filtered() const {
  if (!filters_ || !shortage_.ok()) return std::nullopt;
  Matrix means, deviations;
  filters_->ReadStates(means, deviations);
  FilteredStates filtered{Matrix(design_.basis->size(), means.cols()),
                          Matrix(design_.basis->size(), means.cols())};
  Vector residual(means.cols());
  CollocationMatrix matrix = matrix_;
  matrix.Solve(means(kept_, Eigen::all), filtered.mean, residual);
  matrix.Solve(deviations(kept_, Eigen::all), filtered.deviation, residual);
  return filtered;
}

double RegionalExpansion::LogVarianceError() const {
  if (absorbed_.point_log_variance.size() == 0) return 0;
  Vector coefficients = Vector::Zero(design_.basis->size());
  for (const ChannelSums& sums : absorbed_.sums) coefficients += sums.log_variance;
  Matrix phi;
  design_.basis->EvaluateMany(design_.points(kept_, Eigen::all), phi);
  const Vector errors = absorbed_.point_log_variance(kept_) - phi * coefficients;
  // The fit leaves Q − S degrees of freedom; without any it is exact at the points.
  const auto degrees = static_cast<double>(phi.rows() - phi.cols());
  return degrees > 0 ? errors.norm() / std::sqrt(degrees) : 0;
}

}  // namespace polyest::internal
