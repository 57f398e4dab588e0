// What the variances that filters predict add to the likelihood (regional_expansion.h).

#include <cmath>

#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {

// Adds ½ log(S/σ²) of one sample, discounted as it is itself by the expansion's own error.
void RegionalExpansion::AddLogVariance(const WeightedSample& sample) {
  const double weight = 0.5 * sample.noise / sample.variance();
  const int channel = sample.channel, column = sample.column;
  ChannelSums& sums = absorbed_.sums[static_cast<size_t>(channel)];
  const auto coefficients = block_.log_variance_coefficients.col(column);
  sums.log_variance += weight * coefficients;
  sums.log_variance_at_reference += weight * coefficients.dot(reference_phi_);
  const auto values = block_.log_variances.col(column);
  absorbed_.point_log_variance += weight * values.head(points());
  absorbed_.point_chi_squared.col(channel) += 2 * weight * values.head(points());
  for (int i = 0; i < trajectories_.checks(); ++i) {
    if (!absorbed_.check_valid[static_cast<size_t>(i)]) continue;
    absorbed_.check_chi_squared(i, channel) += values[points() + i];
  }
}

double RegionalExpansion::LogVarianceError() const {
  if (absorbed_.point_log_variance.size() == 0) return 0;
  Vector coefficients = Vector::Zero(design_.basis->size());
  for (const ChannelSums& sums : absorbed_.sums) coefficients += sums.log_variance;
  Matrix phi;
  design_.basis->EvaluateMany(design_.points(kept_points(), Eigen::all), phi);
  const Vector errors = absorbed_.point_log_variance(kept_points()) - phi * coefficients;
  // The fit leaves Q − S degrees of freedom; without any it is exact at the points.
  const auto degrees = static_cast<double>(phi.rows() - phi.cols());
  return degrees > 0 ? errors.norm() / std::sqrt(degrees) : 0;
}

}  // namespace polyest::internal
