#include "core/propagation/block_lu.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>

namespace polyest::internal {
namespace {

TEST(BlockLu, SolvesEachPointsOwnSystemWhateverItsPivots) {
  constexpr int kPoints = 16;
  constexpr int kSize = 5;
  std::vector<Eigen::MatrixXd> matrices;
  BlockLu lu(kPoints, kSize);
  Eigen::ArrayXXd x(kPoints, kSize);
  for (int p = 0; p < kPoints; ++p) {
    Eigen::MatrixXd a(kSize, kSize);
    for (int i = 0; i < kSize; ++i) {
      x(p, i) = std::cos(3.0 * i + p);
      for (int j = 0; j < kSize; ++j) a(i, j) = std::sin(1.3 * (i + 1) * (j + 2) + 5 * p);
    }
    if (p % 2 == 0) a(0, 0) = 0;  // makes pivoting necessary
    matrices.push_back(a);
  }
  for (int i = 0; i < kSize; ++i) {
    for (int j = 0; j < kSize; ++j) {
      Eigen::ArrayXd values(kPoints);
      for (int p = 0; p < kPoints; ++p) values(p) = matrices[p](i, j);
      lu.Set(i, j, values);
    }
  }
  lu.Factor();
  Eigen::ArrayXXd solution = x;
  lu.SolveInPlace(solution);
  for (int p = 0; p < kPoints; ++p) {
    const Eigen::VectorXd exact = matrices[p].partialPivLu().solve(x.row(p).transpose().matrix());
    // Both solutions carry rounding errors of 1e-16 times a condition number, below 1e4 for these.
    EXPECT_LT((solution.row(p).transpose().matrix() - exact).norm(), 1e-11 * exact.norm()) << p;
  }
}

}  // namespace
}  // namespace polyest::internal
