#include "core/propagation/block_vector.h"

#include <gtest/gtest.h>
#include <sundials/sundials_context.h>

#include <limits>
#include <vector>

namespace polyest::internal {
namespace {

class BlockVector : public ::testing::Test {
 protected:
  BlockVector() : scale_(16, 3, 1e-3) {
    for (int k = 0; k < 12; ++k) {
      vectors_.push_back(NewBlockVector(16, 3, &scale_, context_));
      BlockValues(vectors_[k]) = Eigen::ArrayXXd::Constant(16, 3, 1.0 + k);
      BlockValues(vectors_[k])(k, 1) = -0.5 * k - 1;
    }
  }
  ~BlockVector() override {
    for (N_Vector vector : vectors_) N_VDestroy(vector);
  }
  Eigen::ArrayXXd& At(int k) { return BlockValues(vectors_[k]); }

  sundials::Context context_;
  ErrorScale scale_;
  std::vector<N_Vector> vectors_;
};

TEST_F(BlockVector, CombinesAnyNumberOfVectorsAlsoInPlace) {
  for (int terms = 1; terms <= 12; ++terms) {
    std::vector<double> factors;
    Eigen::ArrayXXd expected = Eigen::ArrayXXd::Zero(16, 3);
    for (int k = 0; k < terms; ++k) {
      factors.push_back(k % 4 == 2 ? 0 : 0.25 * k - 1);
      expected += factors[k] * At(k);
    }
    const Eigen::ArrayXXd first = At(0);
    ASSERT_EQ(N_VLinearCombination(terms, factors.data(), vectors_.data(), vectors_[0]), 0);
    // The sums are exact: small multiples of 1/8.
    EXPECT_TRUE((At(0) == expected).all()) << terms;
    At(0) = first;
  }
}

TEST_F(BlockVector, DoesTheElementwiseOperations) {
  const Eigen::ArrayXXd x = At(3), y = At(5);
  N_VLinearSum(2, vectors_[3], -3, vectors_[5], vectors_[0]);
  EXPECT_TRUE((At(0) == 2 * x - 3 * y).all());
  N_VProd(vectors_[3], vectors_[5], vectors_[0]);
  EXPECT_TRUE((At(0) == x * y).all());
  N_VDiv(vectors_[3], vectors_[5], vectors_[0]);
  EXPECT_TRUE((At(0) == x / y).all());
  N_VAbs(vectors_[3], vectors_[0]);
  EXPECT_TRUE((At(0) == x.abs()).all());
  N_VInv(vectors_[3], vectors_[0]);
  EXPECT_TRUE((At(0) == x.inverse()).all());
  N_VAddConst(vectors_[3], 2, vectors_[0]);
  EXPECT_TRUE((At(0) == x + 2).all());
  N_VScale(-4, vectors_[3], vectors_[3]);
  EXPECT_TRUE((At(3) == -4 * x).all());
  N_VConst(7, vectors_[3]);
  EXPECT_TRUE((At(3) == 7).all());
  EXPECT_EQ(N_VMaxNorm(vectors_[5]), y.abs().maxCoeff());
  EXPECT_EQ(N_VMin(vectors_[5]), y.minCoeff());
  EXPECT_DOUBLE_EQ(N_VDotProd(vectors_[5], vectors_[5]), (y * y).sum());
  EXPECT_EQ(N_VGetLength(vectors_[5]), 48);
}

TEST_F(BlockVector, MeasuresTheWorstPointAndRemembersIt) {
  scale_.Grow(Eigen::ArrayXXd::Constant(16, 3, 2.0));
  At(1) = scale_.weights();
  At(0).setZero();
  At(0)(11, 2) = -0.004;
  At(0)(4, 0) = 0.003;
  // The norm is 0.004/(1e-3 · 2).
  EXPECT_NEAR(N_VWrmsNorm(vectors_[0], vectors_[1]), 2, 1e-9);
  EXPECT_EQ(scale_.worst_point(), 11);
  At(0)(7, 1) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(N_VWrmsNorm(vectors_[0], vectors_[1]), ErrorScale::kHuge);
  EXPECT_EQ(scale_.worst_point(), 7);
}

TEST(ErrorScale, RemembersTheLargestMagnitudeOfEachPointsState) {
  ErrorScale scale(8, 1, 1e-2);
  Eigen::ArrayXXd x = Eigen::ArrayXXd::Constant(8, 1, -3.0);
  x(5, 0) = 0;
  scale.Grow(x);
  scale.Grow(Eigen::ArrayXXd::Constant(8, 1, 1e-9));
  EXPECT_NEAR(1 / scale.weights()(2, 0), 3e-2, 1e-12);
  // The errors of a point at 0 are measured against a thousandth of the others' size.
  EXPECT_NEAR(1 / scale.weights()(5, 0), 3e-5, 1e-12);
}

TEST(ErrorScale, CountsTheMagnitudeAtTheEndOfTheStepUnderTest) {
  ErrorScale scale(8, 1, 1e-2);
  const Eigen::ArrayXXd end = Eigen::ArrayXXd::Constant(8, 1, 0.5);
  const Eigen::ArrayXXd error = Eigen::ArrayXXd::Constant(8, 1, 0.01);
  EXPECT_GT(scale.Norm(error, scale.weights()), 1e6);  // Nothing is known of the size.
  scale.Watch(&end);
  EXPECT_NEAR(scale.Norm(error, scale.weights()), 0.01 / (1e-2 * 0.5), 1e-9);
}

}  // namespace
}  // namespace polyest::internal
