#include "core/estimator/posterior/corrected_lag1.h"

#include <algorithm>

#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

// Returns the precision of the channel's noise at d in units of the working noise's; 0 if unknown.
double PrecisionAt(const ChannelSums& sums, const Vector& d, double power) {
  if (!sums.scale_unknown) return power;
  const double chi_squared = sums.samples.ChiSquared(d);
  return chi_squared > 0 ? power * std::max(0.0, sums.Degrees()) / chi_squared : 0;
}

// Returns tr(Sᵀ G S).
double TraceOf(const MismatchSums& sums, const Matrix& spread) {
  return (sums.G() * spread).cwiseProduct(spread).sum();
}

}  // namespace

CorrectedLag1::CorrectedLag1(const Cost& cost, const RegionalExpansion& expansion,
                             const ConstVectorRef& eta)
    : expansion_(expansion), d_(cost.BasisDifference(eta)) {
  const std::vector<ChannelSums>& sums = expansion.sums();
  const Basis& basis = *expansion.design().basis;
  Vector phi(basis.size());
  Matrix slope(basis.size(), cost.dimension());
  basis.EvaluateWithGradient(eta, phi, slope);
  // In germs of unit variance the prior's precision is 1.
  const Vector unit = cost.prior().GermStandardDeviation();
  const Matrix by_unit = slope * Inverse(cost.region().axes()) * unit.asDiagonal();
  Matrix information = Matrix::Identity(cost.dimension(), cost.dimension());
  precision_.resize(std::ssize(sums));
  for (size_t c = 0; c < sums.size(); ++c) {
    const double precision = PrecisionAt(sums[c], d_, cost.power());
    precision_[static_cast<Eigen::Index>(c)] = precision;
    information += precision * (by_unit.transpose() * sums[c].samples.G() * by_unit);
  }
  const CholeskyFactor factor(information);
  spread_ = factor.positive_definite()
                ? Matrix(SolveLower(factor.Lower(), Matrix(by_unit.transpose())).transpose())
                : Matrix::Zero(by_unit.rows(), by_unit.cols());
}

double CorrectedLag1::Of(int channel) const {
  const ChannelSums& sums = expansion_.sums()[static_cast<size_t>(channel)];
  const auto samples = static_cast<double>(sums.samples.count());
  if (samples < 2) return 0;
  const double precision = precision_[channel];
  // A level of m samples has t = 1 and, at the two ends of its run, t_Δ = 2/m.
  const double fitted = precision * TraceOf(sums.samples, spread_) + sums.spent;
  const double of_differences =
      precision * TraceOf(sums.differences, spread_) + 2 * sums.spent * sums.spent / samples;
  const double lost = (fitted - 0.5 * of_differences - 0.5) / std::max(1.0, samples - fitted);
  return std::clamp(sums.Lag1Correlation(d_) + lost, -1.0, 1.0);
}

}  // namespace polyest::internal
