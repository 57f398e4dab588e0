#include "core/bayes/newton_starts.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/core/bayes/many_parameters.h"
#include "tests/unit/core/bayes/polynomial_cost.h"

namespace polyest::internal {
namespace {

MinimizationProblem SearchIn(int n, double half_width) {
  MinimizationProblem problem;
  problem.lower = Vector::Constant(n, -half_width);
  problem.upper = -problem.lower;
  problem.constraint.resize(0, n);
  problem.bound.resize(0);
  return problem;
}

// The minimum of ½ Σ ((z_i − ξ_i)/σ)² + ½ Σ ξ_i² is z/(1 + σ²).
TEST(ImprovedStarts, AreTheOneMinimumOfAQuadraticCost) {
  const int n = 64;
  const Vector z = Vector::LinSpaced(n, -1, 1);
  const Cost cost = CostOfEach(ManyNormals(n), z, 0.5);
  const Matrix starts =
      ImprovedStarts(cost, SearchIn(n, 3), Matrix::Random(12, n), MinimizerOptions());
  ASSERT_EQ(starts.rows(), 1);
  EXPECT_LT((starts.row(0).transpose() - z / 1.25).cwiseAbs().maxCoeff(), 1e-8);
}

// ½ ((1 − a²)/σ)² + ½ a² has its minima at a² = 1 − σ²/2 and a maximum at 0, where Newton's method
// must not end.
TEST(ImprovedStarts, AreBothMinimaOfAnUnobservedSign) {
  const Prior prior = ManyNormals(1);
  const Cost cost = CostOf(prior, {{[](const Vector& xi) { return xi[0] * xi[0]; }, 1, 0.1}});
  Matrix starts(5, 1);
  starts << 0.8, 1.3, -0.9, 0.01, -2;
  const Matrix improved = ImprovedStarts(cost, SearchIn(1, 4), starts, MinimizerOptions());
  const double minimum = std::sqrt(1 - 0.005);
  ASSERT_EQ(improved.rows(), 3);
  EXPECT_NEAR(improved(0, 0), minimum, 1e-8);
  EXPECT_NEAR(improved(1, 0), -minimum, 1e-8);
  EXPECT_EQ(improved(2, 0), 0.01);
}

// The minimum lies outside of the box, or beyond a constraint: the starts stay.
TEST(ImprovedStarts, StayWhereABoundIsActive) {
  const Cost cost = CostOfEach(ManyNormals(2), Vector::Constant(2, 2), 0.1);
  const Matrix starts = Matrix::Random(3, 2);
  EXPECT_EQ(ImprovedStarts(cost, SearchIn(2, 1.5), starts, MinimizerOptions()), starts);
  MinimizationProblem constrained = SearchIn(2, 4);
  constrained.constraint = Matrix::Ones(1, 2);
  constrained.bound = Vector::Constant(1, 3);
  EXPECT_EQ(ImprovedStarts(cost, constrained, starts, MinimizerOptions()), starts);
}

}  // namespace
}  // namespace polyest::internal
