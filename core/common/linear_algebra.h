#pragma once

// Decompositions of dense matrices as plain functions, so that Eigen's templates for them are
// compiled once and not in every source that needs one. They allocate, so no code that runs for
// every sample may use them. They check whether their arguments are finite only where it is stated.

#include <absl/status/statusor.h>

#include <Eigen/LU>

#include "core/common/types.h"
#include "polyest/stop.h"

namespace polyest::internal {

// The decomposition A = V diag(values) Vᵀ of a symmetric n × n matrix.
struct SymmetricEigen {
  Vector values;   // n, ascending
  Matrix vectors;  // n × n, orthonormal columns
  bool converged = false;
};

// Decomposes a symmetric matrix; reads its lower triangle only.
SymmetricEigen DecomposeSymmetric(const Matrix& matrix);
// Decomposes the symmetric tridiagonal matrix with `diagonal` (n ≥ 1) and `off_diagonal` (n − 1).
SymmetricEigen DecomposeTridiagonal(const Vector& diagonal, const Vector& off_diagonal);
// Returns the eigenvalues alone, ascending; reads the lower triangle of `matrix` only.
Vector SymmetricEigenvalues(const Matrix& matrix);

// The factor of A = L Lᵀ, a symmetric positive definite n × n matrix; reads A's lower triangle
// only.
class CholeskyFactor {
 public:
  explicit CholeskyFactor(const Matrix& matrix);

  // Returns whether the matrix was positive definite to working precision; the functions below
  // require it.
  bool positive_definite() const { return positive_definite_; }
  Matrix Lower() const;                          // L
  double HalfLogDeterminant() const;             // ½ log det A = Σ log L_ii
  Vector Solve(const Vector& right) const;       // A⁻¹ right
  Vector SolveLower(const Vector& right) const;  // L⁻¹ right

 private:
  Matrix packed_;  // L in the lower triangle
  bool positive_definite_;
};

// The factors P A = L U of a square matrix, with partial pivoting. A is invertible only if
// LogAbsDeterminant() is finite.
class LuFactors {
 public:
  explicit LuFactors(const Matrix& matrix);

  double LogAbsDeterminant()
      const;  // log |det A| = Σ log |U_ii|, which neither over- nor underflows
  Vector Solve(const Vector& right) const;
  // Solves for each row of `right` (k × n, k ≥ 1); the solutions are rows, too.
  Matrix SolveRows(const Matrix& right) const;

 private:
  Eigen::PartialPivLU<Matrix> factors_;
};

// Returns the inverse of an invertible matrix.
Matrix Inverse(const Matrix& matrix);
// Returns (Aᵀ)⁻¹ right; A must be invertible.
Vector SolveTransposed(const Matrix& matrix, const Vector& right);
// Returns L⁻¹ right. L is the lower triangle of `lower`; its diagonal must have no zero.
Vector SolveLower(const Matrix& lower, const Vector& right);
Matrix SolveLower(const Matrix& lower, const Matrix& right);
// Returns (Lᵀ)⁻¹ r for each row r of `right`; the solutions are rows, too.
Matrix SolveLowerTransposedRows(const ConstMatrixRef& lower, const Matrix& right);

// The factors A = Q R of an m × n matrix, m ≥ n, without pivoting.
struct ThinQr {
  Matrix q;  // m × n, orthonormal columns
  Matrix r;  // n × n, upper triangular
};
// Decomposes a matrix; on a stop request returns its status soon.
absl::StatusOr<ThinQr> DecomposeThinQr(const Matrix& matrix, const Stop& stop = {});
// Returns an orthonormal basis (m × m) whose first column is parallel to `vector` (m ≥ 1, not 0).
Matrix OrthonormalBasisFrom(const Vector& vector);

// The factors A P = Q R of an m × n matrix, with column pivoting.
struct PivotedQr {
  Matrix q;  // m × m; its last m − rank columns span the orthogonal complement of A's range
  Eigen::Index rank = 0;
  Vector solution;  // the least-squares solution of A x = right
};
PivotedQr SolveByPivotedQr(const Matrix& matrix, const Vector& right);

// The rank and condition number of an m × n matrix, m ≥ n ≥ 1, by its singular values; rank 0 and
// +∞ if it has entries that are not finite.
struct Conditioning {
  Eigen::Index rank = 0;  // singular values above n ε times the largest, ε = machine precision
  double number;          // largest singular value ÷ smallest; +∞ when the rank is below n
};
Conditioning ConditioningOf(const Matrix& matrix);
// Returns those of an upper triangular matrix. With more than 256 columns, the condition number is
// a lower bound that is about a percent too low at most, and the rank of a singular matrix an upper
// bound.
Conditioning ConditioningOfTriangular(const Matrix& upper);

}  // namespace polyest::internal
