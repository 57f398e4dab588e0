// Checks each decomposition against its definition, to a small multiple of the rounding of its
// size.

#include "core/common/linear_algebra.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <limits>

namespace polyest::internal {
namespace {

constexpr int kSize = 30;  // larger than the sizes that Eigen multiplies without blocks
constexpr double kRounding = 1e-12;

Matrix SomeMatrix(int rows, int columns) {
  Matrix matrix(rows, columns);
  for (int i = 0; i < rows; ++i) {
    for (int j = 0; j < columns; ++j) matrix(i, j) = std::sin(1.7 * i * columns + 0.9 * j * j);
  }
  return matrix;
}

Matrix SomePositiveDefinite() {
  const Matrix factor = SomeMatrix(kSize, kSize);
  return factor * factor.transpose() + Matrix::Identity(kSize, kSize);
}

TEST(SymmetricEigen, RebuildsTheMatrixFromAscendingEigenvalues) {
  const Matrix matrix = SomePositiveDefinite();
  const SymmetricEigen eigen = DecomposeSymmetric(matrix);
  ASSERT_TRUE(eigen.converged);
  EXPECT_TRUE(std::is_sorted(eigen.values.begin(), eigen.values.end()));
  const Matrix rebuilt = eigen.vectors * eigen.values.asDiagonal() * eigen.vectors.transpose();
  EXPECT_LT((rebuilt - matrix).norm(), kRounding * matrix.norm());
  EXPECT_LT((SymmetricEigenvalues(matrix) - eigen.values).norm(), kRounding * matrix.norm());
}

TEST(SymmetricEigen, ReadsTheLowerTriangleOnly) {
  Matrix matrix = SomePositiveDefinite();
  const Vector values = SymmetricEigenvalues(matrix);
  matrix(0, 1) = 1e9;
  EXPECT_EQ(SymmetricEigenvalues(matrix), values);
}

TEST(SymmetricEigen, KnowsTheSecondDifferencesTridiagonalMatrix) {
  const SymmetricEigen eigen =
      DecomposeTridiagonal(Vector::Constant(kSize, 2), Vector::Constant(kSize - 1, -1));
  for (int k = 0; k < kSize; ++k) {  // λ_k = 2 − 2 cos(kπ/(n + 1)), k = 1 … n
    EXPECT_NEAR(eigen.values[k], 2 - 2 * std::cos((k + 1) * M_PI / (kSize + 1)), kRounding);
  }
}

TEST(CholeskyFactor, SolvesWithAPositiveDefiniteMatrix) {
  const Matrix matrix = SomePositiveDefinite();
  const Vector right = SomeMatrix(kSize, 1);
  const CholeskyFactor factor(matrix);
  ASSERT_TRUE(factor.positive_definite());
  EXPECT_LT((factor.Lower() * factor.Lower().transpose() - matrix).norm(),
            kRounding * matrix.norm());
  EXPECT_LT((matrix * factor.Solve(right) - right).norm(), 1e-10);
  EXPECT_LT((factor.Lower() * factor.SolveLower(right) - right).norm(), 1e-10);
  EXPECT_NEAR(2 * factor.HalfLogDeterminant(), SymmetricEigenvalues(matrix).array().log().sum(),
              1e-9);
}

TEST(CholeskyFactor, RefusesAMatrixThatIsIndefinite) {
  EXPECT_FALSE(CholeskyFactor(Vector::LinSpaced(3, 1, -1).asDiagonal()).positive_definite());
}

TEST(LuFactors, SolveInvertAndTellTheDeterminant) {
  const Matrix matrix = SomePositiveDefinite() + SomeMatrix(kSize, kSize);
  const Matrix rows = SomeMatrix(7, kSize);
  const LuFactors factors(matrix);
  EXPECT_LT((factors.SolveRows(rows) * matrix.transpose() - rows).norm(), 1e-9);
  EXPECT_LT((matrix * factors.Solve(rows.row(0).transpose()) - rows.row(0).transpose()).norm(),
            1e-9);
  EXPECT_LT((matrix * Inverse(matrix) - Matrix::Identity(kSize, kSize)).norm(), 1e-9);
  EXPECT_LT((matrix.transpose() * SolveTransposed(matrix, rows.row(0).transpose()) -
             rows.row(0).transpose())
                .norm(),
            1e-9);
  EXPECT_DOUBLE_EQ(LuFactors(Vector::LinSpaced(3, 1, 3).asDiagonal()).LogAbsDeterminant(),
                   std::log(6));
}

TEST(TriangularSolves, ReadTheLowerTriangleOnly) {
  const Matrix square = SomePositiveDefinite();
  const Matrix lower = square.triangularView<Eigen::Lower>();
  const Matrix right = SomeMatrix(kSize, 5);
  EXPECT_LT((lower * SolveLower(square, right) - right).norm(), 1e-10);
  EXPECT_LT(
      (SolveLowerTransposedRows(square, right.transpose()) * lower - right.transpose()).norm(),
      1e-10);
}

// One panel of columns, some whole ones, and some with a part of one more.
TEST(ThinQr, HasOrthonormalColumnsAndATriangle) {
  for (const Eigen::Index columns : {1, 30, 48, 96, 110}) {
    const Matrix matrix = SomeMatrix(2 * columns, columns);
    const ThinQr factors = *DecomposeThinQr(matrix);
    EXPECT_LT((factors.q * factors.r - matrix).norm(), kRounding * matrix.norm()) << columns;
    EXPECT_LT((factors.q.transpose() * factors.q - Matrix::Identity(columns, columns)).norm(),
              kRounding)
        << columns;
    EXPECT_TRUE(factors.r.isUpperTriangular(0)) << columns;
  }
}

TEST(ThinQr, LooksAtTheStop) {
  const Stop past({}, Stop::Clock::now() - std::chrono::seconds(1));
  EXPECT_EQ(DecomposeThinQr(SomeMatrix(2, 1), past).status().code(),
            absl::StatusCode::kDeadlineExceeded);
}

TEST(OrthonormalBasis, BeginsAlongTheVector) {
  const Vector vector = SomeMatrix(kSize, 1);
  const Matrix basis = OrthonormalBasisFrom(vector);
  EXPECT_NEAR(std::abs(basis.col(0).dot(vector)), vector.norm(), kRounding * vector.norm());
  EXPECT_LT((basis.transpose() * basis - Matrix::Identity(kSize, kSize)).norm(), kRounding);
}

TEST(PivotedQr, FindsTheRankAndTheComplementOfTheRange) {
  Matrix matrix = SomeMatrix(kSize, 4);
  matrix.col(3) = matrix.col(0) + matrix.col(1);
  const PivotedQr factors = SolveByPivotedQr(matrix, matrix.col(2));
  EXPECT_EQ(factors.rank, 3);
  EXPECT_LT((factors.q.rightCols(kSize - 3).transpose() * matrix).norm(), 1e-11);
  EXPECT_LT((matrix * factors.solution - matrix.col(2)).norm(), 1e-11);
}

TEST(Conditioning, IsTheRatioOfSingularValues) {
  const Conditioning good = ConditioningOf(Vector::LinSpaced(5, 1, 100).asDiagonal());
  EXPECT_EQ(good.rank, 5);
  EXPECT_NEAR(good.number, 100, 1e-10);
  const Conditioning singular = ConditioningOf(Vector::LinSpaced(5, 0, 1).asDiagonal());
  EXPECT_EQ(singular.rank, 4);
  EXPECT_EQ(singular.number, std::numeric_limits<double>::infinity());
}

// The oracle is A = U diag(σ) Vᵀ with orthonormal U and V, which has the singular values σ.
TEST(Conditioning, IsThatOfTheSingularValuesAMatrixIsMadeOf) {
  const Vector values = Vector::LinSpaced(kSize, 1, 1e6);
  const Matrix left = OrthonormalBasisFrom(SomeMatrix(kSize, 1).col(0));
  const Matrix right = OrthonormalBasisFrom(SomeMatrix(kSize, 2).col(1));
  const Matrix matrix = left * values.asDiagonal() * right.transpose();
  const Conditioning conditioning = ConditioningOf(matrix);
  EXPECT_EQ(conditioning.rank, kSize);
  // The rounding of the smallest value is some ε of the largest.
  EXPECT_NEAR(conditioning.number, 1e6, 1e6 * 1e6 * kRounding);
  EXPECT_EQ(ConditioningOf(Matrix::Constant(1, 1, -3)).number, 1);
  EXPECT_NEAR(ConditioningOf(left).number, 1, kRounding);  // Many singular values are equal.
  EXPECT_EQ(ConditioningOf(Matrix::Zero(3, 3)).rank, 0);
}

// The oracle is the decomposition; the triangle has more columns than are decomposed.
TEST(Conditioning, IsFoundByIterationForLargeTriangles) {
  Matrix square = SomeMatrix(300, 300);
  square.diagonal() += Vector::LinSpaced(300, 1, 100);
  const Matrix upper = DecomposeThinQr(square)->r;
  const Conditioning exact = ConditioningOf(upper);
  const Conditioning found = ConditioningOfTriangular(upper);
  EXPECT_EQ(found.rank, 300);
  EXPECT_NEAR(found.number, exact.number, 0.01 * exact.number);
  EXPECT_LE(found.number, exact.number * (1 + kRounding));
}

TEST(Conditioning, IsInfiniteForLargeSingularTriangles) {
  Matrix upper = Matrix::Identity(300, 300);
  upper(7, 7) = 0;
  EXPECT_EQ(ConditioningOfTriangular(upper).rank, 299);
  EXPECT_EQ(ConditioningOfTriangular(upper).number, std::numeric_limits<double>::infinity());
  // Kahan's matrix: none of its diagonal entries is small, and yet it is all but singular.
  const double c = std::cos(1.2), s = std::sin(1.2);
  for (Eigen::Index i = 0; i < 300; ++i) {
    upper.row(i).setZero();
    upper(i, i) = std::pow(s, i);
    upper.row(i).tail(299 - i).setConstant(-c * std::pow(s, i));
  }
  EXPECT_LT(ConditioningOfTriangular(upper).rank, 300);
  EXPECT_EQ(ConditioningOfTriangular(upper).number, std::numeric_limits<double>::infinity());
}

TEST(Conditioning, IsTheWorstForEntriesThatAreNotFinite) {
  Matrix matrix = Matrix::Identity(20, 20);
  matrix(3, 4) = std::numeric_limits<double>::quiet_NaN();
  const Conditioning conditioning = ConditioningOf(matrix);
  EXPECT_EQ(conditioning.rank, 0);
  EXPECT_EQ(conditioning.number, std::numeric_limits<double>::infinity());
}

}  // namespace
}  // namespace polyest::internal
