#include "core/estimator/studies/prior_propagation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/model/equations/equation_model.h"
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
    EXPECT_NEAR(x.std_dev[k], t / std::sqrt(3.0), 1e-9);
    EXPECT_NEAR(x.residual[k], 0, 1e-9);
    EXPECT_FALSE(x.from_draws[static_cast<size_t>(k)]);
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
  // So do a fifth of the 512 draws.
  EXPECT_NEAR(static_cast<double>(result.failures.size()), 2 + 0.2 * 512, 2);
  ASSERT_EQ(result.diagnostics.size(), 1u);
  EXPECT_EQ(result.diagnostics[0].code, DiagnosticCode::kPointsFailed);
  EXPECT_THAT(result.diagnostics[0].message, HasSubstr("of 524 trajectories"));
  for (const PointFailure& failure : result.failures) {
    EXPECT_GT(failure.time_s, 0.9);
    EXPECT_FALSE(failure.reason.empty());
  }
  // The model is linear, so that the remaining points still determine it.
  EXPECT_NEAR(result.outputs[0].mean[4], 4, 1e-6);
  EXPECT_NEAR(result.outputs[0].std_dev[4], 2 / std::sqrt(3.0), 1e-6);
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
  EXPECT_THAT(refusal([](auto& o) { o.draws = 7; }),
              HasSubstr("draws: 7 must be from 8 to 100000"));
  EXPECT_THAT(refusal([](auto& o) { o.step_s = 1e-300; }, absl::StatusCode::kResourceExhausted),
              HasSubstr("limit"));
  // The times are 0, 1e-12 … 1 s.
  EXPECT_THAT(refusal(
                  [](auto& o) {
                    o.until_s = 1;
                    o.step_s = 1e-12;
                  },
                  absl::StatusCode::kResourceExhausted),
              HasSubstr("until/step: 1000000000001 times of"));
}

Problem ProblemOf(EquationSpecification equations, UncertainParameter uncertain) {
  Problem problem;
  problem.model = MakeEquationModel(equations).value();
  problem.uncertain = {std::move(uncertain)};
  return problem;
}

// The phase of y = cos(w t) varies by up to 20 rad, which no expansion of order 3 follows. With w
// uniform on [6, 7] the mean is (sin 7t − sin 6t)/t, and that of y² is ½ + (sin 14t − sin
// 12t)/(4t).
TEST(PropagatePrior, HasTheClosedFormOfAnOscillationWhosePhaseIsUncertain) {
  PropagationOptions options;
  options.until_s = 20;
  options.step_s = 0.25;
  const ResolvedProblem problem = Resolve(
      ProblemOf({.outputs = {{"y", "cos(w*t)"}}}, UncertainParameter::Uniform("w", 6, 7).value()));
  for (const int draws : {64, 512}) {
    options.draws = draws;
    const Propagation result = PropagatePrior(problem, options, {}).value();
    EXPECT_EQ(result.draws, draws);
    EXPECT_TRUE(result.diagnostics.empty());
    const PropagatedOutput& y = result.outputs[0];
    EXPECT_FALSE(y.from_draws[1]);
    EXPECT_TRUE(y.from_draws[80]);
    for (int k = 1; k <= 80; ++k) {
      const double t = result.time_s[static_cast<size_t>(k)];
      const double mean = (std::sin(7 * t) - std::sin(6 * t)) / t;
      const double square = 0.5 + (std::sin(14 * t) - std::sin(12 * t)) / (4 * t);
      // Four standard errors. That of a standard deviation is √((μ₄/σ⁴ − 1)/N)/2 of it, at most
      // that of the mean while μ₄ ≤ 5 σ⁴.
      EXPECT_NEAR(y.mean[k], mean, 4 * y.residual[k]) << t;
      EXPECT_NEAR(y.std_dev[k], std::sqrt(square - mean * mean), 4 * y.residual[k]) << t;
    }
  }
}

// After 20 s the phase has gone through 20 rad, beyond three turns, so that y is all but an
// arcsine: the quantiles are near −cos(0.025 π), 0 and cos(0.025 π).
TEST(PropagatePrior, HasTheQuantilesOfAnOscillationWhosePhaseIsUnknown) {
  PropagationOptions options;
  options.until_s = options.step_s = 20;
  const Propagation result =
      PropagatePrior(Resolve(ProblemOf({.outputs = {{"y", "cos(w*t)"}}},
                                       UncertainParameter::Uniform("w", 6, 7).value())),
                     options, {})
          .value();
  const PropagatedOutput& y = result.outputs[0];
  EXPECT_NEAR(y.quantiles(1, 0), -0.997, 0.01);
  EXPECT_NEAR(y.quantiles(1, 2), 0.997, 0.01);
}

// The values of y = 1/(1 + (k/10)²) lie in [0, 1] however large k is, and those of a polynomial in
// ln k do not. The oracle is the mid-point rule over the probability of k.
TEST(PropagatePrior, IsQuadratureForALongTail) {
  const double variance = std::log(5.0);  // of ln k, for a standard deviation of twice the mean
  const Germ germ = Germ::Normal();
  double mean = 0, square = 0;
  constexpr int kIntervals = 20'000;
  for (int i = 0; i < kIntervals; ++i) {
    const double xi = germ.Quantile((i + 0.5) / kIntervals);
    const double k = 30 * std::exp(std::sqrt(variance) * xi - variance / 2);
    const double y = 1 / (1 + k * k / 100);
    mean += y / kIntervals;
    square += y * y / kIntervals;
  }
  for (const int order : {2, 3, 9}) {
    Problem problem = ProblemOf({.outputs = {{"y", "1/(1 + (k/10)^2)"}}},
                                UncertainParameter::Lognormal("k", 30, 60).value());
    problem.expansion.order = order;
    const Propagation result = PropagatePrior(Resolve(problem), UntilTwo(), {}).value();
    const PropagatedOutput& y = result.outputs[0];
    EXPECT_NEAR(y.mean[4], mean, 4 * y.residual[4]) << order;
    EXPECT_NEAR(y.std_dev[4], std::sqrt(square - mean * mean), 4 * y.residual[4]);
    EXPECT_GE(y.quantiles(4, 0), 0) << order;
    EXPECT_LE(y.quantiles(4, 2), 1) << order;
  }
}

TEST(PropagatePrior, SaysThatDrawsAreMissingWhereTheyCount) {
  // The state x becomes infinite soon after 0.5 s where a passes 1.8.
  const Problem problem = ProblemOf({.states = {{"x", "a + if(a > 1.8 && t > 0.5, 1e4*x^2, 0)"}},
                                     .outputs = {{"y", "cos(40*x)"}}},
                                    UncertainParameter::Uniform("a", 1, 2).value());
  const Propagation result = PropagatePrior(Resolve(problem), UntilTwo(), {}).value();
  ASSERT_EQ(result.diagnostics.size(), 2u);
  EXPECT_EQ(result.diagnostics[0].code, DiagnosticCode::kPointsFailed);
  EXPECT_EQ(result.diagnostics[1].code, DiagnosticCode::kExpansionInaccurate);
  EXPECT_THAT(result.diagnostics[1].message, HasSubstr("does not follow y"));
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
