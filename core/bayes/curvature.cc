#include "core/bayes/curvature.h"

#include <cmath>

#include "core/bayes/parameter_covariance.h"
#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

// The tolerance within which a direction's total curvature counts as the prior's own, and the
// direction as limited by the prior, so that rounding does not decide.
constexpr double kSlack = 1e-9;

}  // namespace

Curvature CovarianceFromCurvature(const ConstMatrixRef& hessian, const Prior& prior,
                                  const ConstVectorRef& xi) {
  const Vector deviation = prior.GermStandardDeviation();
  const Eigen::Index n = deviation.size();
  // H_s = D H D, D = diag(prior standard deviations of ξ); s = D⁻¹ ξ
  const Matrix scaled = deviation.asDiagonal() * hessian * deviation.asDiagonal();
  Vector variance = Vector::Ones(n);
  Matrix directions = Matrix::Identity(n, n);
  Curvature result;
  // The prior's covariance is kept if the curvature is not finite.
  result.limited_by_prior = !scaled.allFinite();
  if (!result.limited_by_prior) {
    const SymmetricEigen eigen = DecomposeSymmetric((scaled + scaled.transpose()) / 2);
    directions = eigen.vectors;
    for (Eigen::Index i = 0; i < n; ++i) {
      const double curvature = eigen.values[i];
      if (curvature > 1) variance[i] = 1 / curvature;
      if (!(curvature > 1 + kSlack)) result.limited_by_prior = true;
    }
  }
  for (double& value : variance) value = std::sqrt(value);
  // cov(z) = (F D V √diag(variance)) (…)ᵀ
  const Matrix in_germs = deviation.asDiagonal() * directions * variance.asDiagonal();
  const Matrix root = prior.correlated() ? Matrix(prior.factor() * in_germs) : in_germs;
  result.contraction = root.rowwise().norm().cwiseQuotient(deviation);
  result.covariance = ParameterCovariance(prior, prior.ToScores(xi), root);
  result.standard_deviation = result.covariance.diagonal().cwiseSqrt();
  return result;
}

}  // namespace polyest::internal
