#include <gtest/gtest.h>

#include "core/chaos/basis.h"
#include "core/chaos/collocation_matrix.h"
#include "core/chaos/collocation_points.h"
#include "tests/testing/count_allocations.h"

#if POLYEST_COUNTS_ALLOCATIONS

namespace polyest::internal {
namespace {

class NoAllocation : public ::testing::Test {
 protected:
  const Basis basis_{std::vector<Germ>(12, Germ::Uniform()), 2};
  const Matrix points_ =
      CollocationPoints(PointSet::kHalton, basis_.germs(), 2, 2 * basis_.size()).value();
};

TEST_F(NoAllocation, TheCounterCounts) {
  const int before = testing::allocations;
  const Vector vector = basis_.indices().col(0).cast<double>();
  EXPECT_EQ(vector[0], 0);
  EXPECT_EQ(testing::allocations, before + 1);
}

TEST_F(NoAllocation, WhenTheBasisIsEvaluated) {
  const Vector xi = points_.row(3).transpose();
  Vector phi(basis_.size());
  Matrix gradient(basis_.size(), basis_.dimension()), values;
  basis_.EvaluateMany(points_, values);
  const int before = testing::allocations;
  basis_.Evaluate(xi, phi);
  basis_.EvaluateWithGradient(xi, phi, gradient);
  basis_.EvaluateMany(points_, values);
  EXPECT_EQ(testing::allocations, before);
}

TEST_F(NoAllocation, WhenCoefficientsAreSolvedFor) {
  auto matrix = CollocationMatrix::Factor(basis_, points_).value();
  const Matrix values = points_.leftCols(3).array().sin();
  Matrix coefficients(basis_.size(), 3);
  Vector variance(3);
  const int before = testing::allocations;
  matrix.Solve(values, coefficients, variance);
  EXPECT_EQ(testing::allocations, before);
}

}  // namespace
}  // namespace polyest::internal

#else

TEST(NoAllocation, IsCountedByTheTestsOwnMalloc) {
  GTEST_SKIP() << "a sanitizer or another C library has a malloc of its own";
}

#endif
