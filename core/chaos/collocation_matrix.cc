#include "core/chaos/collocation_matrix.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <utility>

#include "core/common/check.h"
#include "core/common/linear_algebra.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

constexpr Eigen::Index kColumnsAtOnce = 32;

}  // namespace

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
  Matrix matrix;
  basis.EvaluateMany(points, matrix);
  POLYEST_ASSIGN_OR_RETURN(ThinQr factors, DecomposeThinQr(matrix, stop));
  result.triangular_ = std::move(factors.r);
  result.matrix_ = PackedMatrix(matrix);
  result.thin_q_ = PackedMatrix(factors.q.transpose());
  // Columns are filled up with zeros to whole vectors: the order in which their squares are summed
  // would otherwise depend on where they begin in memory.
  result.residuals_.setZero((points.rows() + 7) / 8 * 8, kColumnsAtOnce);
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
  thin_q_.Multiply(values, coefficients);
  for (Eigen::Index j = 0; j < values.cols(); ++j) {
    auto solution = coefficients.col(j);
    triangular_.triangularView<Eigen::Upper>().solveInPlace(solution);
  }
  const int freedom = points() - terms();
  if (freedom == 0) {
    residual_variance.setZero();
    return;
  }
  // ‖Y − A c‖² / (Q − S)
  for (Eigen::Index first = 0; first < values.cols(); first += kColumnsAtOnce) {
    const Eigen::Index count = std::min<Eigen::Index>(kColumnsAtOnce, values.cols() - first);
    auto residuals = residuals_.topLeftCorner(points(), count);
    residuals = values.middleCols(first, count);
    matrix_.Subtract(coefficients.middleCols(first, count), residuals);
    for (Eigen::Index j = 0; j < count; ++j) {
      residual_variance[first + j] = residuals_.col(j).squaredNorm() / freedom;
    }
  }
}

}  // namespace polyest::internal
