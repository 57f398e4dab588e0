#include "core/common/linear_algebra.h"

#include <Eigen/Cholesky>

namespace polyest::internal {

CholeskyFactor::CholeskyFactor(const Matrix& matrix) {
  const Eigen::LLT<Matrix> factor(matrix);
  packed_ = factor.matrixLLT();
  // What is no number passes Eigen's test.
  positive_definite_ = factor.info() == Eigen::Success && packed_.diagonal().allFinite();
}

Matrix CholeskyFactor::Lower() const { return packed_.triangularView<Eigen::Lower>(); }

double CholeskyFactor::HalfLogDeterminant() const { return packed_.diagonal().array().log().sum(); }

Vector CholeskyFactor::Solve(const Vector& right) const {
  Vector solution = right;
  packed_.triangularView<Eigen::Lower>().solveInPlace(solution);
  packed_.triangularView<Eigen::Lower>().adjoint().solveInPlace(solution);
  return solution;
}

Vector CholeskyFactor::SolveLower(const Vector& right) const {
  return polyest::internal::SolveLower(packed_, right);
}

LuFactors::LuFactors(const Matrix& matrix) : factors_(matrix) {}

double LuFactors::LogAbsDeterminant() const {
  return factors_.matrixLU().diagonal().array().abs().log().sum();
}

Vector LuFactors::Solve(const Vector& right) const { return factors_.solve(right); }

Matrix LuFactors::SolveRows(const Matrix& right) const {
  return factors_.solve(right.transpose()).transpose();
}

Matrix Inverse(const Matrix& matrix) { return matrix.inverse(); }

Vector SolveTransposed(const Matrix& matrix, const Vector& right) {
  return matrix.transpose().partialPivLu().solve(right);
}

Vector SolveLower(const Matrix& lower, const Vector& right) {
  return lower.triangularView<Eigen::Lower>().solve(right);
}

Matrix SolveLower(const Matrix& lower, const Matrix& right) {
  return lower.triangularView<Eigen::Lower>().solve(right);
}

Matrix SolveLowerTransposedRows(const ConstMatrixRef& lower, const Matrix& right) {
  return lower.triangularView<Eigen::Lower>().transpose().solve(right.transpose()).transpose();
}

}  // namespace polyest::internal
