// Counts calls of malloc, by which Eigen allocates: this definition replaces the C library's and
// passes calls on to it. Sanitizers bring their own malloc, so these tests are skipped under them.

#include <gtest/gtest.h>

#include <cstddef>
#include <vector>

#include "core/chaos/basis.h"
#include "core/chaos/collocation_matrix.h"
#include "core/chaos/collocation_points.h"
#include "core/common/sanitizer.h"

#if !POLYEST_ADDRESS_SANITIZER && !POLYEST_THREAD_SANITIZER && defined(__GLIBC__)

namespace {
thread_local int allocations = 0;
}  // namespace

extern "C" void* __libc_malloc(std::size_t size);
extern "C" void* malloc(std::size_t size) {
  ++allocations;
  return __libc_malloc(size);
}

namespace polyest::internal {
namespace {

class NoAllocation : public ::testing::Test {
 protected:
  const Basis basis_{std::vector<Germ>(12, Germ::Uniform()), 2};
  const Matrix points_ =
      CollocationPoints(PointSet::kHalton, basis_.germs(), 2, 2 * basis_.size()).value();
};

TEST_F(NoAllocation, TheCounterCounts) {
  const int before = allocations;
  const Vector vector = basis_.indices().col(0).cast<double>();
  EXPECT_EQ(vector[0], 0);
  EXPECT_EQ(allocations, before + 1);
}

TEST_F(NoAllocation, WhenTheBasisIsEvaluated) {
  const Vector xi = points_.row(3).transpose();
  Vector phi(basis_.size());
  Matrix gradient(basis_.size(), basis_.dimension()), values;
  basis_.EvaluateMany(points_, values);
  const int before = allocations;
  basis_.Evaluate(xi, phi);
  basis_.EvaluateWithGradient(xi, phi, gradient);
  basis_.EvaluateMany(points_, values);
  EXPECT_EQ(allocations, before);
}

TEST_F(NoAllocation, WhenCoefficientsAreSolvedFor) {
  auto matrix = CollocationMatrix::Factor(basis_, points_).value();
  const Matrix values = points_.leftCols(3).array().sin();
  Matrix coefficients(basis_.size(), 3);
  Vector variance(3);
  const int before = allocations;
  matrix.Solve(values, coefficients, variance);
  EXPECT_EQ(allocations, before);
}

}  // namespace
}  // namespace polyest::internal

#else

TEST(NoAllocation, IsNotCountedUnderASanitizer) {
  GTEST_SKIP() << "malloc is the sanitizer's or another C library's";
}

#endif
