#include "core/bayes/curvature.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "core/bayes/parameter_covariance.h"

namespace polyest {
namespace {

// A direction in which the total curvature is the prior's own to this much counts as limited by
// the prior, so that rounding does not decide.
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
  // A curvature that is no number knows nothing: the prior's own is kept.
  result.limited_by_prior = !scaled.allFinite();
  if (!result.limited_by_prior) {
    const Eigen::SelfAdjointEigenSolver<Matrix> eigen((scaled + scaled.transpose()) / 2);
    directions = eigen.eigenvectors();
    for (Eigen::Index i = 0; i < n; ++i) {
      const double curvature = eigen.eigenvalues()[i];
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

}  // namespace polyest
