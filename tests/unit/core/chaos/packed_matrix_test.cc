#include "core/chaos/packed_matrix.h"

#include <gtest/gtest.h>

#include <limits>

namespace polyest::internal {
namespace {

// Sizes around those of tiles and of the columns that pass together.
constexpr int kSizes[] = {1, 3, 8, 9, 31, 32, 33, 70};

TEST(PackedMatrix, MultipliesAsAMatrixDoes) {
  for (const int rows : kSizes) {
    for (const int inner : kSizes) {
      for (const int columns : kSizes) {
        const Matrix a = Matrix::Random(rows, inner), x = Matrix::Random(inner, columns);
        const PackedMatrix packed(a);
        EXPECT_EQ(packed.Unpacked(), a);
        Matrix product(rows, columns);
        packed.Multiply(x, product);
        Matrix left = Matrix::Random(rows, columns);
        const Matrix expected = left - a * x;
        packed.Subtract(x, left);
        // Two sums of `inner` products of numbers up to 1, each in an order of its own.
        const double rounding = 2 * (inner + 1) * inner * std::numeric_limits<double>::epsilon();
        EXPECT_LE((product - a * x).cwiseAbs().maxCoeff(), rounding);
        EXPECT_LE((left - expected).cwiseAbs().maxCoeff(), rounding);
      }
    }
  }
}

TEST(PackedMatrix, GivesAColumnTheSameBitsWhateverIsBesideIt) {
  const Matrix a = Matrix::Random(37, 50), x = Matrix::Random(50, 70);
  const PackedMatrix packed(a);
  Matrix together(37, 70);
  packed.Multiply(x, together);
  const Matrix before = Matrix::Random(37, 70);
  Matrix left = before;
  packed.Subtract(x, left);
  for (int first = 0; first < 70; ++first) {
    for (const int count : {1, 2, 5}) {
      if (first + count > 70) continue;
      Matrix some(37, count);
      packed.Multiply(x.middleCols(first, count), some);
      EXPECT_EQ(some, together.middleCols(first, count)) << first << " " << count;
      some = before.middleCols(first, count);
      packed.Subtract(x.middleCols(first, count), some);
      EXPECT_EQ(some, left.middleCols(first, count)) << first << " " << count;
    }
  }
}

}  // namespace
}  // namespace polyest::internal
