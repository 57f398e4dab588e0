#include "core/chaos/collocation_matrix.h"

#include <absl/strings/str_format.h>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <limits>

#include "core/common/check.h"

namespace polyest {
namespace {

struct Conditioning {
  Eigen::Index rank = 0;
  double number = std::numeric_limits<double>::infinity();
};

// Of A, from its triangular factor, which has the same singular values: so no column has to be
// pivoted. Of what is not finite: the worst.
Conditioning ConditioningOf(const Matrix& triangular) {
  const Eigen::BDCSVD<Matrix> svd(triangular);
  Conditioning result;
  if (svd.info() != Eigen::Success) return result;
  result.rank = svd.rank();
  const Vector& values = svd.singularValues();
  const double smallest = values[values.size() - 1];
  if (smallest > 0) result.number = values[0] / smallest;
  return result;
}

}  // namespace

absl::StatusOr<CollocationMatrix> CollocationMatrix::Factor(const Basis& basis,
                                                            const ConstMatrixRef& points,
                                                            double most_condition) {
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
  const Eigen::HouseholderQR<Matrix> qr(result.matrix_);
  result.thin_q_ = qr.householderQ() * Matrix::Identity(points.rows(), terms);
  result.triangular_ = qr.matrixQR().topRows(terms).triangularView<Eigen::Upper>();
  result.workspace_.resize(points.rows());
  const Conditioning conditioning = ConditioningOf(result.triangular_);
  result.condition_ = conditioning.number;
  if (conditioning.rank < terms || !(result.condition_ <= most_condition)) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "collocation: %d points do not determine the %d terms of order %d (rank %d, condition "
        "number %.3g, at most %.3g allowed); use more points or a lower order",
        points.rows(), terms, basis.order(), conditioning.rank, result.condition_, most_condition));
  }
  return result;
}

void CollocationMatrix::Solve(const ConstMatrixRef& values, MatrixRef coefficients,
                              VectorRef residual_variance) {
  POLYEST_CHECK(values.rows() == points() && coefficients.rows() == terms());
  POLYEST_CHECK(coefficients.cols() == values.cols() && residual_variance.size() == values.cols());
  const int freedom = points() - terms();
  // One column at a time: matrix-vector products need no buffers, unlike products of matrices.
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

}  // namespace polyest
