#include <Eigen/Eigenvalues>

#include "core/common/linear_algebra.h"

namespace polyest::internal {
namespace {

SymmetricEigen ResultOf(const Eigen::SelfAdjointEigenSolver<Matrix>& solver) {
  return {solver.eigenvalues(), solver.eigenvectors(), solver.info() == Eigen::Success};
}

}  // namespace

SymmetricEigen DecomposeSymmetric(const Matrix& matrix) {
  return ResultOf(Eigen::SelfAdjointEigenSolver<Matrix>(matrix));
}

SymmetricEigen DecomposeTridiagonal(const Vector& diagonal, const Vector& off_diagonal) {
  Eigen::SelfAdjointEigenSolver<Matrix> solver;
  solver.computeFromTridiagonal(diagonal, off_diagonal);
  return ResultOf(solver);
}

Vector SymmetricEigenvalues(const Matrix& matrix) {
  return Eigen::SelfAdjointEigenSolver<Matrix>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
}

}  // namespace polyest::internal
