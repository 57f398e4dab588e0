#include <Eigen/QR>
#include <algorithm>
#include <vector>

#include "core/common/linear_algebra.h"
#include "core/common/status.h"

namespace polyest::internal {

// Reflections are applied panel by panel (Golub and Van Loan, Matrix Computations, 5.2.3), as Eigen
// does, with a look at the stop before each panel.
absl::StatusOr<ThinQr> DecomposeThinQr(const Matrix& matrix, const Stop& stop) {
  constexpr Eigen::Index kPanel = 48;  // columns
  const Eigen::Index columns = matrix.cols();
  Matrix left = matrix;  // R above, what is still to be reflected below
  std::vector<Eigen::HouseholderQR<Matrix>> panels;
  for (Eigen::Index first = 0; first < columns; first += kPanel) {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    const Eigen::Index width = std::min(kPanel, columns - first);
    const Eigen::Index after = first + width;
    const auto& panel =
        panels.emplace_back(left.middleCols(first, width).bottomRows(matrix.rows() - first));
    left.block(first, first, width, width) =
        panel.matrixQR().topRows(width).template triangularView<Eigen::Upper>();
    left.bottomRightCorner(matrix.rows() - first, columns - after)
        .applyOnTheLeft(panel.householderQ().adjoint());
  }
  ThinQr result;
  result.r = left.topRows(columns).triangularView<Eigen::Upper>();
  left.resize(0, 0);  // Q takes as much memory.
  result.q = Matrix::Identity(matrix.rows(), columns);
  for (auto panel = panels.rbegin(); panel != panels.rend(); ++panel) {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    const Eigen::Index rows = panel->rows();
    result.q.bottomRightCorner(rows, columns - (matrix.rows() - rows))
        .applyOnTheLeft(panel->householderQ());
  }
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
