#include "core/chaos/collocation_matrix.h"

#include <absl/strings/str_format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <limits>

#include "core/common/check.h"

namespace polyest {
namespace {

// Largest over smallest singular value of the triangular factor R, which has those of A. They are
// the upper half of the eigenvalues of [0 R; Rᵀ 0], found without squaring the condition number.
double Condition(const Matrix& triangular) {
  const Eigen::Index terms = triangular.cols();
  Matrix bordered = Matrix::Zero(2 * terms, 2 * terms);
  bordered.topRightCorner(terms, terms) = triangular;
  bordered.bottomLeftCorner(terms, terms) = triangular.transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix> solver(bordered, Eigen::EigenvaluesOnly);
  const double smallest = solver.eigenvalues()[terms],
               largest = solver.eigenvalues()[2 * terms - 1];
  return smallest > 0 ? largest / smallest : std::numeric_limits<double>::infinity();
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
  const Eigen::ColPivHouseholderQR<Matrix> qr(result.matrix_);
  result.thin_q_ = qr.householderQ() * Matrix::Identity(points.rows(), terms);
  result.triangular_ = qr.matrixR().topRows(terms).triangularView<Eigen::Upper>();
  result.permutation_ = qr.colsPermutation().indices();
  result.workspace_.resize(points.rows(), 1);
  result.condition_ = Condition(result.triangular_);
  if (qr.rank() < terms || !(result.condition_ <= most_condition)) {
    return absl::FailedPreconditionError(absl::StrFormat(
        "collocation: %d points do not determine the %d terms of order %d (rank %d, condition "
        "number %.3g, at most %.3g allowed); use more points or a lower order",
        points.rows(), terms, basis.order(), qr.rank(), result.condition_, most_condition));
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
    // A Π = Q R, so R (Πᵀ c) = Qᵀ Y
    auto permuted = workspace_.col(0).head(terms());
    permuted.noalias() = thin_q_.transpose() * values.col(j);
    triangular_.triangularView<Eigen::Upper>().solveInPlace(permuted);
    for (int i = 0; i < terms(); ++i) coefficients(permutation_[i], j) = permuted[i];
    if (freedom == 0) {
      residual_variance[j] = 0;
      continue;
    }
    // ‖Y − A c‖² / (Q − S)
    auto residual = workspace_.col(0);
    residual = values.col(j);
    residual.noalias() -= matrix_ * coefficients.col(j);
    residual_variance[j] = residual.squaredNorm() / freedom;
  }
}

}  // namespace polyest
