#include "core/chaos/collocation_matrix.h"

#include <absl/strings/str_format.h>

#include <utility>

#include "core/common/check.h"
#include "core/common/linear_algebra.h"
#include "core/common/status.h"

namespace polyest::internal {

absl::StatusOr<CollocationMatrix> CollocationMatrix::Factor(const Basis& basis,
                                                            const ConstMatrixRef& points,
                                                            const Stop& stop,
                                                            double max_condition) {
  POLYEST_CHECK(points.cols() == basis.dimension());
  const int terms = basis.size();
  if (points.rows() < terms) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "collocation: an expansion of order %d has %d terms and needs at least as many points, "
        "not %d",
        basis.order(), terms, points.rows()));
  }
  POLYEST_CHECK(points.allFinite());
  CollocationMatrix result;
  basis.EvaluateMany(points, result.matrix_);
  POLYEST_ASSIGN_OR_RETURN(ThinQr factors, DecomposeThinQr(result.matrix_, stop));
  result.thin_q_ = std::move(factors.q);
  result.triangular_ = std::move(factors.r);
  result.workspace_.resize(points.rows());
  // R has the singular values of A.
  const Conditioning conditioning = ConditioningOfTriangular(result.triangular_);
  result.condition_ = conditioning.number;
  if (conditioning.rank < terms || !(result.condition_ <= max_condition)) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "collocation: %d points do not determine the %d terms of order %d (rank %d, condition "
        "number %.3g, at most %.3g allowed); use more points or a lower order",
        points.rows(), terms, basis.order(), conditioning.rank, result.condition_, max_condition));
  }
  return result;
}

void CollocationMatrix::Solve(const ConstMatrixRef& values, MatrixRef coefficients,
                              VectorRef residual_variance) {
  POLYEST_CHECK(values.rows() == points() && coefficients.rows() == terms());
  POLYEST_CHECK(coefficients.cols() == values.cols() && residual_variance.size() == values.cols());
  const int freedom = points() - terms();
  // Matrix-vector products, one column at a time, need no buffers, unlike products of matrices.
  for (Eigen::Index j = 0; j < values.cols(); ++j) {
    auto solution = coefficients.col(j);
    solution.noalias() = thin_q_.transpose() * values.col(j);
    triangular_.triangularView<Eigen::Upper>().solveInPlace(solution);
    if (freedom == 0) {
      residual_variance[j] = 0;
      continue;
    }
    // ‖Y − A c‖² / (Q − S)
    workspace_ = values.col(j);
    workspace_.noalias() -= matrix_ * coefficients.col(j);
    residual_variance[j] = workspace_.squaredNorm() / freedom;
  }
}

}  // namespace polyest::internal
