// How often an expansion moves.

#include "core/estimator/expansion/reexpansion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "core/estimator/expansion/model_agreement.h"
#include "tests/testing/records.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kNoiseOfSine = 0.3;
constexpr int kRowsOfSine = 3000;

// An output of an amplitude a and a frequency w, with flat priors, in three orders.
Problem SineProblem(const std::string& output) {
  Problem problem = TextProblem(output,
                                {UncertainParameter::Uniform("a", 0.5, 2.5).value(),
                                 UncertainParameter::Uniform("w", 0.5, 1.5).value()},
                                kNoiseOfSine);
  problem.expansion.order = 3;
  return problem;
}

// The amplitude of the record grows until a row, by many standard deviations, which its posterior
// follows from edge to edge of one region after another.
Samples GrowingSine(int until) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0, kNoiseOfSine);
  Samples record;
  record.columns = {{"y", {}, {}}};
  for (int k = 1; k <= kRowsOfSine; ++k) {
    const double t = 0.05 * k;
    record.time_s.push_back(t);
    record.columns[0].value.push_back((1 + 3e-4 * std::min(k, until)) * std::sin(t) +
                                      normal(random));
  }
  return record;
}

// With flat priors the least-squares amplitude at the frequency ŵ is Σ z sin ŵt ÷ Σ sin² ŵt.
void ExpectLeastSquares(const Estimate& estimate, const Samples& record) {
  double products = 0, squares = 0;
  for (size_t k = 0; k < record.time_s.size(); ++k) {
    const double sine = std::sin(estimate.parameters[1].map * record.time_s[k]);
    products += record.columns[0].value[k] * sine;
    squares += sine * sine;
  }
  EXPECT_NEAR(estimate.parameters[0].map, products / squares,
              kNegligibleShift * kNoiseOfSine / std::sqrt(squares));
}

TEST(Reexpansion, IsRareForAPosteriorThatWanders) {
  const Samples record = GrowingSine(kRowsOfSine);
  const Estimate estimate =
      testing::EstimateInBatches(SineProblem("a * sin(w * t)"), record, /*batch=*/500);
  ExpectLeastSquares(estimate, record);
  // An expansion runs 25 trajectories, 20 at collocation points and 5 at checks, and each move runs
  // as many again over the rows so far. Regions that are widened by half and contracted at once
  // take 290 in all.
  EXPECT_GT(estimate.expansion.reexpansions, 2);
  EXPECT_LT(estimate.expansion.trajectories, 8 * 25);
}

// The model cannot be run at the amplitudes that a region of the greatest width would reach.
TEST(Reexpansion, WidensLessWhereTheModelFailsFartherOut) {
  const Samples record = GrowingSine(1600);
  const Estimate estimate = testing::EstimateInBatches(
      SineProblem("a * sin(w * t) + 1e-30 * sqrt(1.4 - a)"), record, /*batch=*/500);
  ExpectLeastSquares(estimate, record);
  for (const Diagnostic& diagnostic : estimate.diagnostics) {
    EXPECT_THAT(diagnostic.message, Not(HasSubstr("trajectories could not be integrated")));
  }
}

}  // namespace
}  // namespace polyest::internal
