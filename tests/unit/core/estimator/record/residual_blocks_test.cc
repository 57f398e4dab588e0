// Tests the variance of sums of successive residuals.

#include "core/estimator/record/residual_blocks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace polyest::internal {
namespace {

TEST(ResidualBlocks, HaveTheSumsOfResidualsAtAnyPoint) {
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal(0, 1);
  const Vector delta{{0.7, -1.2}};
  ResidualBlocks blocks(2);
  double squares = 0, squares_of_sums = 0;
  for (int run = 0; run < 3; ++run) {
    double sum = 0, of_block = 0;
    for (int k = 0; k < 50; ++k) {  // three whole blocks and an unfinished one
      const Vector gradient{{normal(generator), normal(generator)}};
      const double residual = normal(generator);
      blocks.Add(gradient, residual);
      const double u = residual - gradient.dot(delta);
      sum += u;
      of_block += u * u;
      if ((k + 1) % ResidualBlocks::kLength != 0) continue;
      squares_of_sums += sum * sum;
      squares += of_block;
      sum = of_block = 0;
    }
    blocks.BeginRun();
  }
  EXPECT_EQ(blocks.count(), 9);
  EXPECT_NEAR(blocks.VarianceRatio(delta), squares_of_sums / squares, 1e-12);
  EXPECT_NEAR(blocks.MeanSquare(delta), squares / (9 * 16), 1e-12);
  EXPECT_TRUE(blocks.HasSizesOf(ResidualBlocks(2)));
  EXPECT_FALSE(blocks.HasSizesOf(ResidualBlocks(3)));
  EXPECT_EQ(blocks.Renewed().count(), 0);
  EXPECT_TRUE(blocks.HasSizesOf(blocks.Renewed()));
}

}  // namespace
}  // namespace polyest::internal
