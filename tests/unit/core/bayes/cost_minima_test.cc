#include "core/bayes/cost_minima.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/core/bayes/many_parameters.h"
#include "tests/unit/core/bayes/polynomial_cost.h"

namespace polyest::internal {
namespace {

// Returns the search for minima of the cost, which must outlive it, within ±half_width.
MinimizationProblem SearchFor(const Cost& cost, double half_width) {
  const auto n = static_cast<Eigen::Index>(cost.dimension());
  MinimizationProblem problem;
  problem.function = [&cost](const Vector& eta, Vector* gradient) {
    if (gradient == nullptr) return cost.Evaluate(eta).total;
    return cost.EvaluateWithGradient(eta, *gradient).total;
  };
  problem.lower = Vector::Constant(n, -half_width);
  problem.upper = -problem.lower;
  problem.constraint.resize(0, n);
  problem.bound.resize(0);
  return problem;
}

// The minimum of ½ Σ ((z_i − ξ_i)/σ)² + ½ Σ ξ_i² is z/(1 + σ²).
TEST(CostMinima, AreTheOneMinimumOfAQuadraticCost) {
  const int n = 64;
  const Vector z = Vector::LinSpaced(n, -1, 1);
  const Cost cost = CostOfEach(ManyNormals(n), z, 0.5);
  const auto minima = FindMinimaOf(cost, SearchFor(cost, 3), Matrix::Random(12, n), Stop());
  ASSERT_EQ(minima.size(), 1u);
  EXPECT_TRUE(minima[0].converged);
  EXPECT_LT((minima[0].point - z / 1.25).cwiseAbs().maxCoeff(), 1e-12);
}

// ½ ((1 − a²)/σ)² + ½ a² has its minima at a² = 1 − σ²/2 and a maximum at 0, where Newton's method
// must not end.
TEST(CostMinima, AreBothMinimaOfAnUnobservedSign) {
  const Prior prior = ManyNormals(1);
  const Cost cost = CostOf(prior, {{[](const Vector& xi) { return xi[0] * xi[0]; }, 1, 0.1}});
  const MinimizationProblem search = SearchFor(cost, 4);
  EXPECT_FALSE(MinimumByNewton(cost, search, Vector::Constant(1, 0.01)));
  Matrix starts(5, 1);
  starts << 0.8, 1.3, -0.9, 0.01, -2;
  const auto minima = FindMinimaOf(cost, search, starts, Stop());
  ASSERT_EQ(minima.size(), 2u);
  EXPECT_NEAR(std::abs(minima[0].point[0]), std::sqrt(1 - 0.005), 1e-12);
  EXPECT_NEAR(minima[1].point[0], -minima[0].point[0], 1e-12);
  // Nor does the search end there if it begins there, where the gradient is 0.
  const auto one = FindMinimaOf(cost, search, Matrix::Zero(1, 1), Stop());
  ASSERT_EQ(one.size(), 1u);
  EXPECT_NEAR(std::abs(one[0].point[0]), std::sqrt(1 - 0.005), 1e-12);
}

// The minimum of ½ Σ ((2 − ξ_i)/σ)² + ½ Σ ξ_i² in the box is its corner; with ξ_1 + ξ_2 ≤ 3, the
// middle of that edge; from a corner of the box that holds nothing back, Newton's method gets away.
TEST(CostMinima, LieOnTheBoundsThatAreActive) {
  const Cost cost = CostOfEach(ManyNormals(2), Vector::Constant(2, 2), 0.1);
  const MinimizationProblem boxed = SearchFor(cost, 1.5);
  for (const Vector& start : {Vector{{0.1, -0.7}}, Vector{{1.5, -1.5}}, Vector{{-1.5, -1.5}}}) {
    const auto minimum = MinimumByNewton(cost, boxed, start);
    ASSERT_TRUE(minimum);
    EXPECT_LT((*minimum - Vector::Constant(2, 1.5)).cwiseAbs().maxCoeff(), 1e-12);
  }
  EXPECT_FALSE(MinimumByNewton(cost, boxed, Vector::Constant(2, 1.6)));
  // A search by gradients may end outside by as much as rounding.
  const auto rounded = MinimumByNewton(cost, boxed, Vector::Constant(2, std::nextafter(1.5, 2)));
  ASSERT_TRUE(rounded);
  EXPECT_EQ(*rounded, Vector::Constant(2, 1.5));

  MinimizationProblem constrained = SearchFor(cost, 4);
  constrained.constraint = Matrix::Ones(1, 2);
  constrained.bound = Vector::Constant(1, 3);
  const auto minimum = MinimumByNewton(cost, constrained, Vector{{-1, 0.3}});
  ASSERT_TRUE(minimum);
  EXPECT_LT((*minimum - Vector::Constant(2, 1.5)).cwiseAbs().maxCoeff(), 1e-12);
}

// Within |a| ≤ ½ the cost of an unobserved sign has its minima on the bounds, where it is concave:
// where the search is held, the curvature along the way out does not matter.
TEST(CostMinima, LieOnBoundsWhereTheCostIsConcave) {
  const Prior prior = ManyNormals(1);
  const Cost cost = CostOf(prior, {{[](const Vector& xi) { return xi[0] * xi[0]; }, 1, 0.1}});
  const MinimizationProblem search = SearchFor(cost, 0.5);
  // A search by gradients may leave it at the bound but for rounding.
  for (const double start : {0.5, std::nextafter(0.5, 0)}) {
    const auto held = MinimumByNewton(cost, search, Vector::Constant(1, start));
    ASSERT_TRUE(held);
    EXPECT_EQ((*held)[0], 0.5);
  }
  const auto minima = FindMinimaOf(cost, search, Matrix{{0.1}, {-0.2}}, Stop());
  ASSERT_EQ(minima.size(), 2u);
  EXPECT_EQ(std::abs(minima[0].point[0]), 0.5);
  EXPECT_EQ(minima[1].point[0], -minima[0].point[0]);
}

// A limit that stopped a step is left again where the cost falls away from it: Rosenbrock's valley,
// cut at x ≤ 0.5, ends on that line, at y = x².
TEST(CostMinima, LieAtTheEndOfAValleyThatIsCutOff) {
  const Prior prior = ManyNormals(2);
  const Cost cost =
      CostOf(prior, {{[](const Vector& xi) { return xi[1] - xi[0] * xi[0]; }, 0, 1e-3},
                     {[](const Vector& xi) { return xi[0]; }, 1, 1e-2}});
  MinimizationProblem search = SearchFor(cost, 2);
  search.constraint = Matrix{{1, 0}};
  search.bound = Vector::Constant(1, 0.5);
  const auto minimum = MinimumByNewton(cost, search, Vector{{-1, 1}});
  ASSERT_TRUE(minimum);
  EXPECT_NEAR((*minimum)[0], 0.5, 1e-12);
  EXPECT_NEAR((*minimum)[1], 0.25, 1e-6);  // the prior pulls by 0.25 σ²
}

}  // namespace
}  // namespace polyest::internal
