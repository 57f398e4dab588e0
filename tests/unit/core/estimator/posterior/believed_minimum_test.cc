// Which of several minima of a cost the estimate is.

#include "core/estimator/posterior/believed_minimum.h"

#include <gtest/gtest.h>

#include <limits>
#include <vector>

namespace polyest::internal {
namespace {

// Three minima in the plane with standard deviations of 0.1, 6 apart.
class BelievedMinimumOfThree : public ::testing::Test {
 protected:
  static Minimum At(double x, double value) {
    Minimum minimum;
    minimum.point = (Vector(2) << x, 0).finished();
    minimum.value = value;
    minimum.converged = true;
    return minimum;
  }

  // Returns 100 points, `first` of them at the first minimum and the others at the second.
  static Matrix Draws(int first) {
    Matrix etas = Matrix::Zero(100, 2);
    etas.col(0).tail(100 - first).setConstant(6);
    return etas;
  }

  size_t Believed(const Matrix& checks, const Matrix& etas) const {
    return BelievedMinimum(minima_, hessians_, checks, etas, Vector::Constant(100, 0.01));
  }

  std::vector<Minimum> minima_ = {At(0, 10), At(6, 12), At(12, 13)};
  std::vector<Matrix> hessians_ = std::vector<Matrix>(3, 100 * Matrix::Identity(2, 2));
  const Matrix no_checks_ = Matrix(0, 2);
};

TEST_F(BelievedMinimumOfThree, IsTheLowestWhereDrawsAreAroundIt) {
  EXPECT_EQ(Believed(no_checks_, Draws(50)), 0);
  EXPECT_EQ(Believed(no_checks_, Draws(6)), 0);
}

TEST_F(BelievedMinimumOfThree, IsNotOneThatHardlyAnyDrawsAreAround) {
  EXPECT_EQ(Believed(no_checks_, Draws(4)), 1);
  EXPECT_EQ(Believed(no_checks_, Draws(0)), 1);
}

// 0.3 and 0.4 are 3 and 4 standard deviations; the surroundings end at √2 + 2 = 3.41.
TEST_F(BelievedMinimumOfThree, IsTheLowestWhereACheckPointIsNearIt) {
  EXPECT_EQ(Believed((Matrix(1, 2) << 0.3, 0).finished(), Draws(0)), 0);
  EXPECT_EQ(Believed((Matrix(1, 2) << 0.4, 0).finished(), Draws(0)), 1);
}

TEST_F(BelievedMinimumOfThree, IsTheLowestWhereOthersAreNotComparable) {
  minima_[1].value = minima_[2].value = 17.1;
  EXPECT_EQ(Believed(no_checks_, Draws(0)), 0);
}

TEST_F(BelievedMinimumOfThree, HasUnboundedSurroundingsWhereTheCurvatureIsNegative) {
  hessians_[0](0, 0) = -100;
  EXPECT_EQ(Believed(no_checks_, Draws(0)), 0);
}

TEST_F(BelievedMinimumOfThree, HasAFiniteCurvature) {
  hessians_[0](0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(Believed(no_checks_, Draws(50)), 1);
}

}  // namespace
}  // namespace polyest::internal
