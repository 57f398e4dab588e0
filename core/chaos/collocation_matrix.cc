#include "core/chaos/collocation_matrix.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <utility>

#include "core/common/check.h"
#include "core/common/infeasible.h"
#include "core/common/linear_algebra.h"
#include "core/common/parallel.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

// So many columns are one thread's work at a time: as many as pass a tile of a packed matrix.
constexpr Eigen::Index kColumnsAtOnce = 36;

// Returns the matrix whose sweep upwards solves R x = b: with the inverse D_t of the square of the
// tile t on the diagonal, x_t = D_t b_t − D_t R_t,>t x_>t. The squares are small, and so is what
// their inverses lose.
Matrix BackSubstitution(const Matrix& triangular) {
  const Eigen::Index terms = triangular.rows();
  Matrix sweep = Matrix::Zero(terms, terms);
  for (Eigen::Index first = 0; first < terms; first += PackedMatrix::kTile) {
    const Eigen::Index count = std::min<Eigen::Index>(PackedMatrix::kTile, terms - first);
    const Eigen::Index right = terms - first - count;
    const Matrix square = triangular.block(first, first, count, count);
    const Matrix inverse =
        square.triangularView<Eigen::Upper>().solve(Matrix::Identity(count, count));
    sweep.block(first, first, count, count) = inverse;
    sweep.block(first, first + count, count, right) =
        -inverse * triangular.block(first, first + count, count, right);
  }
  return sweep;
}

}  // namespace

absl::StatusOr<CollocationMatrix> CollocationMatrix::Factor(const Basis& basis,
                                                            const ConstMatrixRef& points,
                                                            const Stop& stop,
                                                            double max_condition) {
  POLYEST_CHECK(points.cols() == basis.dimension());
  const int terms = basis.size();
  if (points.rows() < terms) {
    return InfeasibleError(absl::StrFormat(
        "collocation: an expansion of order %d has %d terms and needs at least as many points, "
        "not %d",
        basis.order(), terms, points.rows()));
  }
  POLYEST_CHECK(points.allFinite());
  CollocationMatrix result;
  Matrix matrix;
  basis.EvaluateMany(points, matrix);
  POLYEST_ASSIGN_OR_RETURN(ThinQr factors, DecomposeThinQr(matrix, stop));
  result.matrix_ = PackedMatrix(matrix);
  result.thin_q_ = PackedMatrix(factors.q.transpose());
  result.ReserveResiduals(kColumnsAtOnce);
  // R has the singular values of A.
  const Conditioning conditioning = ConditioningOfTriangular(factors.r);
  result.condition_ = conditioning.number;
  if (conditioning.rank < terms || !(result.condition_ <= max_condition)) {
    return InfeasibleError(absl::StrFormat(
        "collocation: %d points do not determine the %d terms of order %d (rank %d, condition "
        "number %.3g, at most %.3g allowed); use more points or a lower order",
        points.rows(), terms, basis.order(), conditioning.rank, result.condition_, max_condition));
  }
  result.back_substitution_ = PackedMatrix(BackSubstitution(factors.r));
  return result;
}

// Columns are filled up with zeros to whole vectors: the order in which their squares are summed
// would otherwise depend on where they begin in memory.
void CollocationMatrix::ReserveResiduals(Eigen::Index columns) {
  if (columns > residuals_.cols()) residuals_.setZero((points() + 7) / 8 * 8, columns);
}

void CollocationMatrix::Solve(const ConstMatrixRef& values, MatrixRef coefficients,
                              VectorRef residual_variance, int threads) {
  POLYEST_CHECK(values.rows() == points() && coefficients.rows() == terms());
  POLYEST_CHECK(coefficients.cols() == values.cols() && residual_variance.size() == values.cols());
  ReserveResiduals(values.cols());
  const auto parts = static_cast<int>((values.cols() + kColumnsAtOnce - 1) / kColumnsAtOnce);
  // Qᵀ Y, R⁻¹ (Qᵀ Y) and A c
  const int64_t operations = int64_t{terms()} * (4 * points() + terms()) * values.cols();
  ParallelFor(parts, ThreadsFor(operations, threads), [&](int part) {
    const Eigen::Index first = part * kColumnsAtOnce;
    const Eigen::Index count = std::min(kColumnsAtOnce, values.cols() - first);
    SolveSome(values.middleCols(first, count), coefficients.middleCols(first, count),
              residual_variance.segment(first, count), residuals_.middleCols(first, count));
  });
}

void CollocationMatrix::SolveSome(const ConstMatrixRef& values, MatrixRef coefficients,
                                  VectorRef residual_variance, MatrixRef residuals) const {
  thin_q_.Multiply(values, coefficients);
  back_substitution_.SweepUpwards(coefficients);
  const int freedom = points() - terms();
  if (freedom == 0) {
    residual_variance.setZero();
    return;
  }
  // ‖Y − A c‖² / (Q − S)
  matrix_.Subtract(coefficients, values, residuals.topRows(points()));
  for (Eigen::Index j = 0; j < values.cols(); ++j) {
    residual_variance[j] = residuals.col(j).squaredNorm() / freedom;
  }
}

}  // namespace polyest::internal
