// Tests costs over grids where streamed inputs lack samples or come early. The model is ẋ = a + u,
// x(0) = 0.

#include <gtest/gtest.h>

#include "core/estimator/studies/cost_grid.h"
#include "polyest/equation_model.h"
#include "tests/unit/core/estimator/estimation.h"

namespace polyest::internal {
namespace {

Problem DrivenRamp() {
  EquationSpecification equations;
  equations.states = {{"x", "a + u"}};
  equations.outputs = {{"x", "x"}};
  equations.inputs = {"u"};
  Problem problem;
  problem.model = MakeEquationModel(equations).value();
  problem.uncertain = {UncertainParameter::Uniform("a", 1, 3).value()};
  problem.inputs = {{"u", StreamedInput{.interpolation = Interpolation::kLinear}}};
  problem.measured = {{"x", {.absolute = 0.5}}};
  return problem;
}

// Returns J_mismatch at a = 1, 2 and 3.
Vector MismatchOf(const Problem& problem, const Samples& samples) {
  CostGridOptions options;
  options.points = 3;
  return EvaluateCostGrid(ResolvedProblem::Make(problem).value(), samples, options, {})
      .value()
      .mismatch.col(0);
}

// u = 2t gives x = a t + t². The data are met exactly at a = 2 and missed by t at a = 3.
TEST(CostGridInputs, MayLackSamplesInAnyRow) {
  Samples samples;
  samples.time_s = {0, 0.7, 1, 2};
  samples.columns = {{"u", {0, 99, 2, 4}, {false, true, false, false}},
                     {"x", {0, 99, 3, 8}, {false, true, false, false}}};
  const Vector mismatch = MismatchOf(DrivenRamp(), samples);
  EXPECT_NEAR(mismatch[1], 0, 1e-8);
  EXPECT_NEAR(mismatch[2], 0.5 * (1 + 4) / 0.25, 1e-6);
}

// An input that is early is not known for the last samples, which are left out as in an estimate:
// u(t + 0.5) = 2t + 1 gives x = (a + 1) t + t², and the sample 99 is after t = 1.5.
TEST(CostGridInputs, LeaveOutSamplesForWhichTheyAreNotKnown) {
  Problem problem = DrivenRamp();
  problem.fixed["u.delay"] = -0.5;
  Samples samples;
  samples.time_s = {0, 1, 2};
  samples.columns = {{"u", {0, 2, 4}, {}}, {"x", {0, 4, 99}, {}}};
  const Vector mismatch = MismatchOf(problem, samples);
  EXPECT_NEAR(mismatch[1], 0, 1e-8);
  EXPECT_NEAR(mismatch[2], 0.5 / 0.25, 1e-6);
}

}  // namespace
}  // namespace polyest::internal
