#include <Eigen/QR>

#include "core/common/linear_algebra.h"

namespace polyest::internal {

ThinQr DecomposeThinQr(const Matrix& matrix) {
  const Eigen::HouseholderQR<Matrix> factors(matrix);
  const Eigen::Index columns = matrix.cols();
  ThinQr result;
  result.q = factors.householderQ() * Matrix::Identity(matrix.rows(), columns);
  result.r = factors.matrixQR().topRows(columns).triangularView<Eigen::Upper>();
  return result;
}

Matrix OrthonormalBasisFrom(const Vector& vector) {
  const Eigen::HouseholderQR<Matrix> factors{Matrix(vector)};
  return factors.householderQ() * Matrix::Identity(vector.size(), vector.size());
}

PivotedQr SolveByPivotedQr(const Matrix& matrix, const Vector& right) {
  const Eigen::ColPivHouseholderQR<Matrix> factors(matrix);
  PivotedQr result;
  result.q = factors.householderQ() * Matrix::Identity(matrix.rows(), matrix.rows());
  result.rank = factors.rank();
  result.solution = factors.solve(right);
  return result;
}

}  // namespace polyest::internal
