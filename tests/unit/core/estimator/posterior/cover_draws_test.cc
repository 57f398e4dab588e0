#include "core/estimator/posterior/cover_draws.h"

#include <gtest/gtest.h>

#include "tests/unit/core/bayes/many_parameters.h"
#include "tests/unit/core/bayes/polynomial_cost.h"

namespace polyest::internal {
namespace {

// Two pieces that are far narrower than the cover's spacing are symmetric: y = p² and q are
// measured. A cover that sees only one of them must not be taken for the posterior.
TEST(CoverDraws, DoNotLoseAPieceBetweenTheirPoints) {
  const Prior prior = ManyUniforms(2);
  for (const double noise : {0.1, 0.01, 1e-3, 1e-4}) {
    const Cost cost = CostOf(prior, {{[](const Vector& xi) { return xi[0] * xi[0]; }, 0.5, noise},
                                     {[](const Vector& xi) { return xi[1]; }, 0.123, noise}});
    ExpansionDesign design;
    design.region = Region::WholePrior(2);
    design.lower = Vector::Constant(2, -1);
    design.upper = Vector::Constant(2, 1);
    const auto draws = DrawFromCover(cost, design, 65'536, 2'000);
    if (!draws) continue;
    EXPECT_NEAR(draws->weights.dot(draws->etas.col(0)), 0, 0.05) << noise;
  }
}

}  // namespace
}  // namespace polyest::internal
