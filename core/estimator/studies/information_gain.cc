#include "core/estimator/studies/information_gain.h"

#include <cmath>
#include <utility>

#include "core/bayes/parameter_covariance.h"
#include "core/chaos/collocation_points.h"
#include "core/common/check.h"

namespace polyest::internal {

Matrix DrawTruths(const Prior& prior, int count) { return HaltonDraws(prior.germs(), count); }

TruthDraws::TruthDraws(const Prior& prior, Matrix xis)
    : prior_(prior),
      mean_(prior.dimension()),
      scale_(prior.GermStandardDeviation()),
      xis_(std::move(xis)) {
  for (int i = 0; i < prior.dimension(); ++i) {
    mean_[i] = prior.germs()[static_cast<size_t>(i)].Mean();
  }
}

InformationGain TruthDraws::Expected(const std::vector<Matrix>& information) const {
  POLYEST_CHECK(information.size() == static_cast<size_t>(count()));
  InformationGain gain{0, Vector::Zero(prior_.dimension())};
  for (int draw = 0; draw < count(); ++draw) {
    const CholeskyFactor factor = FactorPrecision(information[static_cast<size_t>(draw)]);
    gain.bits += factor.HalfLogDeterminant() / std::log(2.0);
    gain.std_dev += StandardDeviation(draw, factor.Lower());
  }
  gain.bits /= count();
  gain.std_dev /= count();
  return gain;
}

// Returns the posterior standard deviations. `lower_root` is R with R Rᵀ = M.
Vector TruthDraws::StandardDeviation(int draw, const Matrix& lower_root) const {
  // M⁻¹ = R⁻ᵀ R⁻¹ is the posterior covariance of the scaled germs.
  const Matrix inverse_root =
      SolveLower(lower_root, Matrix(Matrix::Identity(mean_.size(), mean_.size())));
  const Matrix root = inverse_root.transpose();
  // The centre of the posterior that data from this true value would give: (Id − M⁻¹) u relative to
  // the prior's mean. It is the true value for perfect data and the prior's mean for data without
  // information.
  const Vector u = (xi(draw) - mean_).cwiseQuotient(scale_);
  const Vector centre = mean_ + scale_.asDiagonal() * (u - root * (inverse_root * u));
  const Matrix& F = prior_.factor();
  return ParameterCovariance(prior_, F * centre, F * scale_.asDiagonal() * root)
      .diagonal()
      .cwiseSqrt();
}

}  // namespace polyest::internal
