#include "core/estimator/posterior/corrected_lag1.h"

#include <algorithm>

#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

// Returns tr(Sᵀ G S).
double TraceOf(const MismatchSums& sums, const Matrix& spread) {
  return (sums.G() * spread).cwiseProduct(spread).sum();
}

}  // namespace

CorrectedLag1::CorrectedLag1(const Cost& cost, const Basis& basis, const ConstVectorRef& eta)
    : power_(cost.power()), spread_(Matrix::Zero(basis.size(), cost.dimension())) {
  // In germs of unit variance the prior's precision is 1.
  const Matrix to_local =
      Inverse(cost.region().axes()) * cost.prior().GermStandardDeviation().asDiagonal();
  const Matrix information = to_local.transpose() * cost.MismatchHessian(eta) * to_local;
  if (!information.allFinite()) return;
  const SymmetricEigen eigen = DecomposeSymmetric(information);
  const Vector deviation = (eigen.values.array().max(0) + 1).rsqrt();
  Vector phi(basis.size());
  Matrix slope(basis.size(), cost.dimension());
  basis.EvaluateWithGradient(eta, phi, slope);
  spread_ = slope * to_local * eigen.vectors * deviation.asDiagonal();
}

double CorrectedLag1::Of(const ChannelSums& sums, const ConstVectorRef& d) const {
  const auto samples = static_cast<double>(sums.samples.count());
  if (samples < 2) return 0;
  // In units of the working noise's variance.
  const double variance = sums.scale_unknown ? sums.samples.ChiSquared(d) / sums.Degrees() : 1;
  if (!(variance > 0)) return 0;
  const double unit = power_ / variance;
  // A level of m samples has t = 1 and, at the two ends of its run, t_Δ = 2/m.
  const double fitted = unit * TraceOf(sums.samples, spread_) + sums.spent;
  const double of_differences =
      unit * TraceOf(sums.differences, spread_) + 2 * sums.spent * sums.spent / samples;
  const double lost = (fitted - 0.5 * of_differences - 0.5) / std::max(1.0, samples - fitted);
  return std::clamp(sums.Lag1Correlation(d) + lost, -1.0, 1.0);
}

}  // namespace polyest::internal
