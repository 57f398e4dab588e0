#include "core/chaos/packed_matrix.h"

#include <gtest/gtest.h>

#include <algorithm>
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
        packed.Subtract(x, left, left);
        // Two sums of `inner` products of numbers up to 1, each in an order of its own.
        const double rounding = 2 * (inner + 1) * inner * std::numeric_limits<double>::epsilon();
        EXPECT_LE((product - a * x).cwiseAbs().maxCoeff(), rounding);
        EXPECT_LE((left - expected).cwiseAbs().maxCoeff(), rounding);
      }
    }
  }
}

TEST(PackedMatrix, SweepsUpwards) {
  for (const int size : kSizes) {
    Matrix a = Matrix::Random(size, size) / size;
    for (int tile = 1; tile * PackedMatrix::kTile < size; ++tile) {
      const int first = tile * PackedMatrix::kTile;
      a.block(first, 0, std::min(PackedMatrix::kTile, size - first), first).setZero();
    }
    for (const int columns : kSizes) {
      const Matrix x = Matrix::Random(size, columns);
      Matrix expected = x;
      for (int end = size; end > 0;) {
        const int first = (end - 1) / PackedMatrix::kTile * PackedMatrix::kTile;
        expected.middleRows(first, end - first) =
            (a.middleRows(first, end - first) * expected).eval();
        end = first;
      }
      Matrix swept = x;
      PackedMatrix(a).SweepUpwards(swept);
      // Each tile sums `size` products of numbers up to 1 by factors up to 1/size, in an order of
      // its own, and takes over what the tiles below have lost.
      const int tiles = (size + PackedMatrix::kTile - 1) / PackedMatrix::kTile;
      const double rounding = 2 * tiles * (size + 1) * std::numeric_limits<double>::epsilon();
      EXPECT_LE((swept - expected).cwiseAbs().maxCoeff(), rounding);
      for (int column = 0; column < columns; ++column) {
        Matrix alone = x.col(column);
        PackedMatrix(a).SweepUpwards(alone);
        EXPECT_EQ(alone, swept.col(column));
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
  packed.Subtract(x, left, left);
  for (int first = 0; first < 70; ++first) {
    for (const int count : {1, 2, 5}) {
      if (first + count > 70) continue;
      Matrix some(37, count);
      packed.Multiply(x.middleCols(first, count), some);
      EXPECT_EQ(some, together.middleCols(first, count)) << first << " " << count;
      some = before.middleCols(first, count);
      packed.Subtract(x.middleCols(first, count), some, some);
      EXPECT_EQ(some, left.middleCols(first, count)) << first << " " << count;
    }
  }
}

}  // namespace
}  // namespace polyest::internal
