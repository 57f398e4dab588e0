#include "core/estimator/expansion/absorbed_rows.h"

#include <utility>

namespace polyest::internal {
namespace {

// Adds to χ² what the logarithms of the variances add, for channels whose samples are kept with
// them. Both have a row for each point.
Matrix WithLogVariances(const AbsorbedRows& rows, Matrix chi_squared, const Matrix& log_variance) {
  for (int c = 0; c < static_cast<int>(chi_squared.cols()); ++c) {
    if (!rows.KeptRelative(c)) continue;
    const ChannelSums& sums = rows.sums[static_cast<size_t>(c)];
    for (Eigen::Index i = 0; i < chi_squared.rows(); ++i) {
      chi_squared(i, c) = sums.WithLogVariance(chi_squared(i, c), log_variance(i, c));
    }
  }
  return chi_squared;
}

}  // namespace

AbsorbedRows::AbsorbedRows(const AbsorbedSizes& sizes)
    : sums(static_cast<size_t>(sizes.channels), ChannelSums(sizes.terms)),
      discount(Vector::Zero(sizes.channels)),
      outliers(static_cast<size_t>(sizes.channels), 0),
      densities(static_cast<size_t>(sizes.channels)),
      previous_coefficients(Matrix::Zero(sizes.terms, sizes.channels)),
      previous_error(Vector::Zero(sizes.channels)),
      profiles(static_cast<size_t>(sizes.channels)),
      largest(Vector::Zero(sizes.channels)),
      check_chi_squared(Matrix::Zero(sizes.check_points, sizes.channels)),
      check_residual(Vector::Zero(sizes.check_points)),
      check_valid(static_cast<size_t>(sizes.check_points), true),
      point_chi_squared(Matrix::Zero(sizes.points, sizes.channels)),
      control_scores(Matrix::Zero(sizes.terms, sizes.controls * sizes.channels)),
      control_valid(static_cast<size_t>(sizes.controls), true) {}

double AbsorbedRows::LogNormalization(bool with_own_error) const {
  if (!few) return with_own_error ? log_variance : log_noise;
  return with_own_error ? few->log_variance : few->log_noise;
}

const RobustSamples* AbsorbedRows::KeptSamples(int channel) const {
  if (!few) return nullptr;
  const RobustSamples& kept = few->channels[static_cast<size_t>(channel)];
  return kept.outliers() == OutlierHandling::kNone ? nullptr : &kept;
}

const RelativeSamples* AbsorbedRows::KeptRelative(int channel) const {
  if (!few) return nullptr;
  const RelativeSamples& kept = few->relative[static_cast<size_t>(channel)];
  return kept.keeps() ? &kept : nullptr;
}

double AbsorbedRows::ChiSquaredAt(int channel, const ConstVectorRef& d) const {
  if (const RelativeSamples* kept = KeptRelative(channel)) return kept->At(d).chi_squared;
  return sums[static_cast<size_t>(channel)].samples.ChiSquared(d);
}

Matrix AbsorbedRows::PointChiSquared() const {
  if (!few) return point_chi_squared;
  return WithLogVariances(*this, few->point_chi_squared, few->point_log_variance);
}

Matrix AbsorbedRows::CheckChiSquared() const {
  if (!few) return check_chi_squared;
  return WithLogVariances(*this, few->check_chi_squared, few->check_log_variance);
}

}  // namespace polyest::internal
