#include <Eigen/SVD>
#include <limits>
#include <optional>

#include "core/common/linear_algebra.h"

namespace polyest::internal {

// By Golub and Kahan (1965): A = U B Vᵀ with an upper bidiagonal B of the same singular values σ_i;
// the symmetric tridiagonal matrix of twice its size that has zeros on its diagonal and b_11, b_12,
// b_22, b_23, … beside it has the eigenvalues ±σ_i. Eigen's own singular value decompositions take
// the compiler five times as long.
Conditioning ConditioningOf(const Matrix& matrix) {
  Conditioning result{0, std::numeric_limits<double>::infinity()};
  if (!matrix.allFinite()) return result;
  const Eigen::Index size = matrix.cols();
  auto bidiagonal = Eigen::internal::UpperBidiagonalization<Matrix>(matrix).bidiagonal();
  Vector beside(2 * size - 1);
  for (Eigen::Index i = 0; i < size; ++i) {
    beside[2 * i] = bidiagonal.diagonal<0>()[i];
    if (i + 1 < size) beside[2 * i + 1] = bidiagonal.diagonal<1>()[i];
  }
  const std::optional<Vector> values = TridiagonalEigenvalues(Vector::Zero(2 * size), beside);
  if (!values.has_value()) return result;
  const auto singular_values = values->tail(size);  // ascending
  const double largest = singular_values[size - 1];
  // What rounding makes of a singular value of 0 is below this.
  const double zero = size * std::numeric_limits<double>::epsilon() * largest;
  result.rank = (singular_values.array() > zero).count();
  if (result.rank == size) result.number = largest / singular_values[0];
  return result;
}

}  // namespace polyest::internal
