#include "core/estimator/posterior/other_minima.h"

#include <gtest/gtest.h>

#include "core/bayes/cost_minima.h"
#include "core/estimator/expansion/search_domain.h"
#include "tests/unit/core/bayes/many_parameters.h"
#include "tests/unit/core/bayes/polynomial_cost.h"

namespace polyest::internal::other_minima_test {
namespace {

// Returns the other minima of a cost with two, at a ≈ ±½ and b ≈ ¼: that b = a² is known to 10⁻³,
// and a² = ¼ to `noise`. The straight way between the minima leads over a wall; the valley b = a²
// rises to ½ (¼ ÷ noise)² at a = 0.
std::vector<Vector> OthersOf(double noise) {
  const Prior prior = ManyNormals(2);
  const Cost cost =
      CostOf(prior, {{[](const Vector& xi) { return xi[1] - xi[0] * xi[0]; }, 0, 1e-3},
                     {[](const Vector& xi) { return xi[0] * xi[0]; }, 0.25, noise}});
  ExpansionDesign design;
  design.region = Region::WholePrior(2);
  design.lower = Vector::Constant(2, -3);
  design.upper = Vector::Constant(2, 3);
  const MinimizationProblem search = SearchOf(cost, design);
  const std::vector<Minimum> minima =
      FindMinimaOf(cost, search, Matrix{{0.5, 0.25}, {-0.5, 0.25}}, Stop());
  EXPECT_EQ(minima.size(), 2u);
  return OtherMinima(cost, design, prior, minima, Stop());
}

TEST(OtherMinima, AreThoseBehindAWall) { EXPECT_EQ(OthersOf(0.05).size(), 1u); }

TEST(OtherMinima, AreNotThoseToWhichACurvedValleyLeads) { EXPECT_EQ(OthersOf(0.4).size(), 0u); }

}  // namespace
}  // namespace polyest::internal::other_minima_test
