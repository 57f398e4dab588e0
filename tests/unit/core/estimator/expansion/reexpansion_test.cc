// How often an expansion moves.

#include "core/estimator/expansion/reexpansion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/estimator/expansion/model_agreement.h"
#include "tests/testing/records.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal {
namespace {

// The amplitude of the record nearly doubles, by many standard deviations, which its posterior
// follows from edge to edge of one region after another. With flat priors the least-squares
// amplitude at the frequency ŵ is Σ z sin ŵt ÷ Σ sin² ŵt.
TEST(Reexpansion, IsRareForAPosteriorThatWanders) {
  constexpr double kNoiseOfSine = 0.3;
  Problem problem = TextProblem("a * sin(w * t)",
                                {UncertainParameter::Uniform("a", 0.5, 2.5).value(),
                                 UncertainParameter::Uniform("w", 0.5, 1.5).value()},
                                kNoiseOfSine);
  problem.expansion.order = 3;
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0, kNoiseOfSine);
  Samples record;
  record.columns = {{"y", {}, {}}};
  for (int k = 1; k <= 3000; ++k) {
    const double t = 0.05 * k;
    record.time_s.push_back(t);
    record.columns[0].value.push_back((1 + 3e-4 * k) * std::sin(t) + normal(random));
  }
  const Estimate estimate = testing::EstimateInBatches(problem, record, 500);
  double products = 0, squares = 0;
  for (size_t k = 0; k < record.time_s.size(); ++k) {
    const double sine = std::sin(estimate.parameters[1].map * record.time_s[k]);
    products += record.columns[0].value[k] * sine;
    squares += sine * sine;
  }
  const ParameterEstimate& amplitude = estimate.parameters[0];
  EXPECT_NEAR(amplitude.map, products / squares,
              kNegligibleShift * kNoiseOfSine / std::sqrt(squares));
  // An expansion runs 25 trajectories, 20 at collocation points and 5 at checks, and each move runs
  // as many again over the rows so far. Regions that are widened by half and contracted at once
  // take 290 in all.
  EXPECT_GT(estimate.expansion.reexpansions, 2);
  EXPECT_LT(estimate.expansion.trajectories, 8 * 25);
}

}  // namespace
}  // namespace polyest::internal
