#include "core/estimator/expansion/germ_summary.h"

#include "core/common/linear_algebra.h"

namespace polyest::internal {

GermSummary SummaryOf(const Matrix& particles) {
  GermSummary summary;
  summary.mean = particles.colwise().mean().transpose();
  const Matrix centred = particles.rowwise() - summary.mean.transpose();
  summary.covariance = centred.transpose() * centred / static_cast<double>(particles.rows());
  return summary;
}

Matrix FactorOf(const Matrix& covariance) {
  const SymmetricEigen eigen = DecomposeSymmetric(covariance);
  return eigen.vectors * eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal();
}

}  // namespace polyest::internal
