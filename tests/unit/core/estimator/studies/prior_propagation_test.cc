#include "core/estimator/studies/prior_propagation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/core/estimator/studies/ramp.h"

namespace polyest::internal::ramp {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

PropagationOptions UntilTwo() {
  PropagationOptions options;
  options.until_s = 2;
  options.step_s = 0.5;
  return options;
}

TEST(PropagatePrior, HasTheClosedFormOfALinearModel) {
  const Propagation result = PropagatePrior(Resolve(RampProblem()), UntilTwo(), {}).value();
  EXPECT_THAT(result.time_s, ElementsAre(0, 0.5, 1, 1.5, 2));
  EXPECT_EQ(result.order, 2);
  EXPECT_EQ(result.terms, 3);
  EXPECT_EQ(result.points, 12);
  EXPECT_TRUE(result.failures.empty());
  ASSERT_EQ(result.outputs.size(), 1u);
  const PropagatedOutput& x = result.outputs[0];
  EXPECT_EQ(x.output, "x");
  EXPECT_EQ(x.unit, "m");
  for (int k = 0; k < 5; ++k) {
    const double t = result.time_s[static_cast<size_t>(k)];
    // The integrator is exact on x = a t, except for rounding.
    EXPECT_NEAR(x.mean[k], 2 * t, 1e-9);
    EXPECT_NEAR(x.standard_deviation[k], t / std::sqrt(3.0), 1e-9);
    EXPECT_NEAR(x.residual[k], 0, 1e-9);
    // The error of 10,000 low-discrepancy draws is about a thousandth.
    EXPECT_NEAR(x.quantiles(k, 0), 1.05 * t, 2e-3);
    EXPECT_NEAR(x.quantiles(k, 1), 2 * t, 2e-3);
    EXPECT_NEAR(x.quantiles(k, 2), 2.95 * t, 2e-3);
  }
}

TEST(PropagatePrior, AnswersTheOutputsAskedForAndAllIfNoneIsMeasured) {
  PropagationOptions options = UntilTwo();
  options.outputs = {"twice"};
  const ResolvedProblem problem = Resolve(RampProblem());
  const Propagation asked = PropagatePrior(problem, options, {}).value();
  ASSERT_EQ(asked.outputs.size(), 1u);
  EXPECT_NEAR(asked.outputs[0].mean[4], 8, 1e-9);

  Problem unmeasured = RampProblem();
  unmeasured.measured.clear();
  const Propagation all = PropagatePrior(Resolve(unmeasured), UntilTwo(), {}).value();
  ASSERT_EQ(all.outputs.size(), 2u);
  EXPECT_NEAR(all.outputs[0].mean[4], 4, 1e-9);
  EXPECT_NEAR(all.outputs[1].mean[4], 8, 1e-9);
}

TEST(PropagatePrior, DoesNotDependOnTheNumberOfTimesAskedForAtOnce) {
  PropagationOptions fine = UntilTwo();
  fine.step_s = 1.0 / 256;  // This makes several chunks.
  const ResolvedProblem problem = Resolve(RampProblem());
  const Propagation result = PropagatePrior(problem, fine, {}).value();
  ASSERT_EQ(result.time_s.size(), 513u);
  EXPECT_EQ(result.time_s.back(), 2);
  for (int k = 0; k <= 512; ++k) EXPECT_NEAR(result.outputs[0].mean[k], 2 * k / 256.0, 1e-9);
}

TEST(PropagatePrior, DensitiesHaveUnitArea) {
  PropagationOptions options = UntilTwo();
  options.density_bins = 20;
  const Propagation result = PropagatePrior(Resolve(RampProblem()), options, {}).value();
  ASSERT_EQ(result.outputs[0].densities.size(), 5u);
  const DensityEstimate& density = result.outputs[0].densities[4];
  ASSERT_EQ(density.value.size(), 20);
  const double width = density.value[1] - density.value[0];
  EXPECT_NEAR(density.density.sum() * width, 1, 1e-12);
  // The output a t is uniform on [2, 6].
  EXPECT_NEAR(density.density.maxCoeff(), 0.25, 0.01);
  EXPECT_NEAR(density.density.minCoeff(), 0.25, 0.01);
}

TEST(PropagatePrior, LeavesOutPointsThatFailWhileEnoughRemain) {
  Problem problem = RampProblem();
  problem.fixed["limit"] = 2.6;  // Two of the 12 values of a lie above it.
  const Propagation result = PropagatePrior(Resolve(problem), UntilTwo(), {}).value();
  EXPECT_EQ(result.failures.size(), 2u);
  for (const PointFailure& failure : result.failures) {
    EXPECT_GT(failure.time_s, 0.9);
    EXPECT_FALSE(failure.reason.empty());
  }
  // The model is linear, so that the remaining points still determine it.
  EXPECT_NEAR(result.outputs[0].mean[4], 4, 1e-6);
  EXPECT_NEAR(result.outputs[0].standard_deviation[4], 2 / std::sqrt(3.0), 1e-6);
}

TEST(PropagatePrior, RefusesWhenTooFewPointsRemainAndNamesAFailure) {
  Problem problem = RampProblem();
  problem.fixed["limit"] = 1.2;
  EXPECT_THAT(Refusal(PropagatePrior(Resolve(problem), UntilTwo(), {}),
                      absl::StatusCode::kFailedPrecondition),
              AllOf(HasSubstr("of 12 collocation points"), HasSubstr("a = "), HasSubstr("t = 1")));
}

TEST(PropagatePrior, RefusalNamesFieldValueAndRule) {
  const ResolvedProblem problem = Resolve(RampProblem());
  const auto refusal = [&](auto change,
                           absl::StatusCode code = absl::StatusCode::kInvalidArgument) {
    PropagationOptions options = UntilTwo();
    change(options);
    return Refusal(PropagatePrior(problem, options, {}), code);
  };
  EXPECT_THAT(refusal([](auto& o) { o.until_s = 0; }), HasSubstr("until_s: 0 must be"));
  EXPECT_THAT(refusal([](auto& o) { o.until_s = kInfinity; }), HasSubstr("until_s: inf"));
  EXPECT_THAT(refusal([](auto& o) { o.step_s = std::nan(""); }), HasSubstr("step_s: nan"));
  EXPECT_THAT(refusal([](auto& o) { o.step_s = 3; }),
              HasSubstr("step_s: 3 must be at most until 2"));
  EXPECT_THAT(refusal([](auto& o) {
                o.probabilities = {0.5, 1.5};
              }),
              HasSubstr("probabilities[1]: 1.5"));
  EXPECT_THAT(refusal([](auto& o) { o.density_bins = -1; }), HasSubstr("density_bins: -1"));
  EXPECT_THAT(refusal([](auto& o) { o.density_samples = 0; }), HasSubstr("density_samples: 0"));
  EXPECT_THAT(refusal([](auto& o) { o.threads = 0; }), HasSubstr("threads: 0"));
  EXPECT_THAT(refusal([](auto& o) {
                o.outputs = {"x", "y"};
              }),
              AllOf(HasSubstr("outputs[1]"), HasSubstr("\"y\""), HasSubstr("x, twice")));
  EXPECT_THAT(refusal([](auto& o) { o.outputs = {"x", "x"}; }), HasSubstr("twice"));
  EXPECT_THAT(refusal([](auto& o) { o.step_s = 1e-300; }, absl::StatusCode::kResourceExhausted),
              HasSubstr("limit"));
}

TEST(PropagatePrior, RefusesAStreamedInput) {
  Problem problem = RampProblem();
  problem.inputs = {{"u", StreamedInput{}}};
  EXPECT_THAT(
      Refusal(PropagatePrior(Resolve(problem), UntilTwo(), {}), absl::StatusCode::kInvalidArgument),
      HasSubstr("u is streamed"));
}

TEST(PropagatePrior, EndsOnAStopRequest) {
  std::stop_source source;
  source.request_stop();
  EXPECT_EQ(
      PropagatePrior(Resolve(RampProblem()), UntilTwo(), Stop(source.get_token())).status().code(),
      absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace polyest::internal::ramp
