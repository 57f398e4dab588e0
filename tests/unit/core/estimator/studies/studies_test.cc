#include "core/estimator/studies/cost_grid.h"
#include "core/estimator/studies/prior_propagation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace polyest::internal::studies_test {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// The model dx/dt = a + u, x(0) = x0, with outputs x and 2x, has closed forms for everything. If a
// passes `limit`, the derivative gains 1000 x² at t = 1, so that x is infinite within a
// millisecond.
class Ramp : public StateSpaceModel {
 public:
  Ramp() {
    description_.name = "ramp";
    description_.states = {{"x", "m", "", 0}};
    description_.parameters = {{"a", "m/s", "", 1}, {"x0", "m", "", 0}, {"limit", "m/s", "", 1e9}};
    description_.inputs = {{"u", "m/s", "", 0}};
    description_.outputs = {{"x", "m", "", 0}, {"twice", "m", "", 0}};
  }
  const ModelDescription& description() const override { return description_; }
  void InitialStates(const ConstBlock& parameters, Block states) const override {
    states.col(0) = parameters.col(1);
  }
  void Derivatives(double time_s, const ConstBlock& states, const ConstBlock& parameters,
                   const ConstBlock& inputs, Block derivatives) const override {
    for (Eigen::Index i = 0; i < derivatives.rows(); ++i) {
      const bool fails = time_s > 1 && parameters(i, 0) > parameters(i, 2);
      derivatives(i, 0) = parameters(i, 0) + inputs(i, 0);
      if (fails) derivatives(i, 0) += 1000 * states(i, 0) * states(i, 0);
    }
  }
  void Outputs(double, const ConstBlock& states, const ConstBlock&, const ConstBlock&,
               Block outputs) const override {
    outputs.col(0) = states.col(0);
    outputs.col(1) = 2 * states.col(0);
  }

 private:
  ModelDescription description_;
};

// Makes the problem with a uniform on [1, 3] and x measured with σ = 0.5.
Problem RampProblem() {
  Problem problem;
  problem.model = std::make_shared<Ramp>();
  problem.uncertain = {UncertainParameter::Uniform("a", 1, 3).value()};
  problem.measured = {{"x", {.absolute = 0.5}}};
  problem.expansion.order = 2;
  problem.expansion.points_per_term = 4;
  return problem;
}

ResolvedProblem Resolve(Problem problem) {
  return ResolvedProblem::Make(std::move(problem)).value();
}

template <class Result>
std::string Refusal(const absl::StatusOr<Result>& result, absl::StatusCode code) {
  EXPECT_EQ(result.status().code(), code) << result.status();
  return std::string(result.status().message());
}

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

Samples ThreeRows() {
  Samples samples;
  samples.time_s = {0.5, 1, 2};
  samples.columns = {{"x", {1.2, 2.5, 3.9}, {}}};
  return samples;
}

TEST(CostGrid, IsTheSumOverTheSamplesAndThePrior) {
  Problem problem = RampProblem();
  problem.regularization = 3;
  CostGridOptions options;
  options.points = 5;
  const CostGrid grid = EvaluateCostGrid(Resolve(problem), ThreeRows(), options, {}).value();
  EXPECT_THAT(grid.parameters, ElementsAre("a"));
  ASSERT_EQ(grid.axes[0].size(), 5);
  ASSERT_EQ(grid.mismatch.rows(), 5);
  ASSERT_EQ(grid.mismatch.cols(), 1);
  for (int i = 0; i < 5; ++i) {
    const double a = 1 + 0.5 * i;
    EXPECT_DOUBLE_EQ(grid.axes[0][i], a);
    double mismatch = 0;
    for (int k = 0; k < 3; ++k) {
      const double t = ThreeRows().time_s[static_cast<size_t>(k)];
      const double z = ThreeRows().columns[0].value[static_cast<size_t>(k)];
      mismatch += 0.5 * std::pow((z - a * t) / 0.5, 2);
    }
    EXPECT_NEAR(grid.mismatch(i, 0), mismatch, 1e-8);
    // The uniform germ has density ½ on all of Ω, both bounds included.
    EXPECT_NEAR(grid.prior(i, 0), std::log(2.0), 1e-15);
    EXPECT_NEAR(grid.total(i, 0), grid.mismatch(i, 0) + 3 * std::log(2.0), 1e-12);
  }
}

TEST(CostGrid, WeighsThePriorByTheGivenChoiceOfARuleAndNeedsIt) {
  Problem problem = RampProblem();
  problem.regularization_mode = RegularizationMode::kEvidence;
  CostGridOptions options;
  options.points = 3;
  EXPECT_EQ(EvaluateCostGrid(Resolve(problem), ThreeRows(), options, {}).status().message(),
            "regularization: must be given for a problem in which a rule chooses it");
  options.regularization = 0.25;
  const CostGrid grid = EvaluateCostGrid(Resolve(problem), ThreeRows(), options, {}).value();
  EXPECT_EQ(grid.regularization, 0.25);
  for (int i = 0; i < 3; ++i) {
    EXPECT_DOUBLE_EQ(grid.total(i, 0), grid.mismatch(i, 0) + 0.25 * grid.prior(i, 0));
  }
  options.regularization = -1;
  EXPECT_EQ(EvaluateCostGrid(Resolve(problem), ThreeRows(), options, {}).status().message(),
            "regularization: -1 must be finite and at least 0");
}

TEST(CostGrid, LeavesOutMissingSamplesAndStartsEachRunAnew) {
  Samples samples;
  samples.time_s = {1, 2, 0.5, 1.5};
  samples.run = {0, 0, 1, 1};
  samples.columns = {{"x", {2.5, -99, 1.2, 3}, {false, true, false, false}}};
  CostGridOptions options;
  options.points = 3;
  const CostGrid grid = EvaluateCostGrid(Resolve(RampProblem()), samples, options, {}).value();
  const double a = 2;
  const double expected =
      (std::pow(2.5 - a, 2) + std::pow(1.2 - a * 0.5, 2) + std::pow(3 - a * 1.5, 2)) / (2 * 0.25);
  EXPECT_NEAR(grid.mismatch(1, 0), expected, 1e-8);
}

TEST(CostGrid, TakesTheNoiseFromTheLargestSampleSoFar) {
  Problem problem = RampProblem();
  problem.measured[0].noise = {.relative_to_max = 0.1};
  Samples samples;
  samples.time_s = {0.5, 1, 1.5};
  samples.columns = {{"x", {2, -4, 1}, {}}};
  CostGridOptions options;
  options.points = 3;
  const CostGrid grid = EvaluateCostGrid(Resolve(problem), samples, options, {}).value();
  // The noise is σ = 0.2, 0.4, 0.4, and a = 2.
  EXPECT_NEAR(grid.mismatch(1, 0), 0.5 * (25 + 225 + 25), 1e-6);
}

TEST(CostGrid, TakesStreamedInputsFromTheSamples) {
  Problem problem = RampProblem();
  problem.inputs = {{"u", StreamedInput{}}};
  Samples samples;
  samples.time_s = {0, 1, 2};
  samples.columns = {{"u", {0, 2, 4}, {}}, {"x", {0, 3, 8}, {}}};
  CostGridOptions options;
  options.points = 3;
  const CostGrid grid = EvaluateCostGrid(Resolve(problem), samples, options, {}).value();
  // The input u = 2t gives x = a t + t². The data are met exactly at a = 2 and missed by t at a =
  // 3.
  EXPECT_NEAR(grid.mismatch(1, 0), 0, 1e-8);
  EXPECT_NEAR(grid.mismatch(2, 0), 0.5 * (1 + 4) / 0.25, 1e-6);
}

TEST(CostGrid, OverTwoParametersHasTheFirstDownTheRows) {
  Problem problem = RampProblem();
  problem.uncertain = {UncertainParameter::Uniform("a", 1, 3).value(),
                       UncertainParameter::Normal("u.amplitude", 0, 0.25).value(),
                       UncertainParameter::Beta("x0", 2, 2, -1, 1).value()};
  problem.inputs = {{"u", ConstantInput{}}};
  CostGridOptions options;
  options.points = 5;
  options.parameters = {"x0", "a"};
  options.held = {{"u.amplitude", 0.5}};
  const CostGrid grid = EvaluateCostGrid(Resolve(problem), ThreeRows(), options, {}).value();
  EXPECT_THAT(grid.parameters, ElementsAre("x0", "a"));
  EXPECT_TRUE(grid.axes[0].isApprox(Vector::LinSpaced(5, -1, 1)));
  EXPECT_TRUE(grid.axes[1].isApprox(Vector::LinSpaced(5, 1, 3)));
  // The output is x = x0 + (a + ½) t at x0 = −½, a = 3.
  const double expected =
      (std::pow(1.2 + 0.5 - 1.75, 2) + std::pow(2.5 + 0.5 - 3.5, 2) + std::pow(3.9 + 0.5 - 7, 2)) /
      (2 * 0.25);
  EXPECT_NEAR(grid.mismatch(1, 4), expected, 1e-7);
  // The density of beta(2, 2) is 0 at its bounds.
  EXPECT_EQ(grid.prior(0, 2), kInfinity);
  EXPECT_EQ(grid.total(4, 2), kInfinity);
  EXPECT_TRUE(std::isfinite(grid.total(1, 0)));
}

TEST(CostGrid, GoesFourDeviationsWhereThePriorHasNoBound) {
  Problem problem = RampProblem();
  problem.uncertain = {UncertainParameter::Gamma("a", 4, 0.5, 1).value(),
                       UncertainParameter::Normal("x0", 2, 0.25).value()};
  CostGridOptions options;
  options.points = 3;
  const CostGrid grid = EvaluateCostGrid(Resolve(problem), ThreeRows(), options, {}).value();
  EXPECT_TRUE(grid.axes[0].isApprox(Eigen::Vector3d(1, 4, 7)));  // mean 3 + 4 · 1
  EXPECT_TRUE(grid.axes[1].isApprox(Eigen::Vector3d(1, 2, 3)));
}

TEST(CostGrid, IsInfiniteWhereTheModelFails) {
  Problem problem = RampProblem();
  problem.fixed["limit"] = 2.2;
  CostGridOptions options;
  options.points = 5;
  const CostGrid grid = EvaluateCostGrid(Resolve(problem), ThreeRows(), options, {}).value();
  EXPECT_TRUE(std::isfinite(grid.mismatch(2, 0)));
  EXPECT_EQ(grid.mismatch(3, 0), kInfinity);
  EXPECT_EQ(grid.total(4, 0), kInfinity);

  // It fails after the last sample, in a row without any.
  Samples samples = ThreeRows();
  samples.columns[0].missing = {false, false, true};
  const CostGrid later = EvaluateCostGrid(Resolve(problem), samples, options, {}).value();
  EXPECT_TRUE(std::isfinite(later.mismatch(2, 0)));
  EXPECT_EQ(later.mismatch(3, 0), kInfinity);
}

TEST(CostGrid, RefusalNamesFieldValueAndRule) {
  Problem two = RampProblem();
  two.uncertain.push_back(UncertainParameter::Uniform("x0", 0, 1).value());
  const ResolvedProblem problem = Resolve(two);
  const auto refusal = [&](auto change,
                           absl::StatusCode code = absl::StatusCode::kInvalidArgument) {
    CostGridOptions options;
    options.points = 3;
    options.parameters = {"a"};
    Samples samples = ThreeRows();
    change(options, samples);
    return Refusal(EvaluateCostGrid(problem, samples, options, {}), code);
  };
  EXPECT_THAT(refusal([](auto& o, auto&) { o.parameters = {"b"}; }),
              AllOf(HasSubstr("parameters[0]"), HasSubstr("\"b\""), HasSubstr("a, x0")));
  EXPECT_THAT(refusal([](auto& o, auto&) { o.parameters = {"a", "a"}; }), HasSubstr("twice"));
  EXPECT_THAT(refusal([](auto& o, auto&) {
                o.parameters = {"a", "x0", "a"};
              }),
              HasSubstr("one or two"));
  EXPECT_THAT(refusal([](auto& o, auto&) { o.points = 1; }), HasSubstr("points: 1"));
  EXPECT_THAT(refusal([](auto& o, auto&) { o.points = -4; }), HasSubstr("points: -4"));
  EXPECT_THAT(refusal([](auto& o, auto&) { o.held = {{"a", 1}}; }), HasSubstr("held.a"));
  EXPECT_THAT(refusal([](auto& o, auto&) { o.held = {{"q", 1}}; }), HasSubstr("a, x0"));
  EXPECT_THAT(refusal([](auto& o, auto&) { o.held = {{"x0", 2}}; }), HasSubstr("held.x0: 2"));
  EXPECT_THAT(refusal([](auto& o, auto&) { o.held = {{"x0", std::nan("")}}; }), HasSubstr("nan"));
  EXPECT_THAT(refusal([](auto&, auto& s) { s.time_s[1] = 0.1; }), HasSubstr("row 1"));
  EXPECT_THAT(refusal([](auto&, auto& s) { s.columns[0].name = "y"; }), HasSubstr("\"y\""));
  EXPECT_THAT(refusal([](auto&, auto& s) { s = Samples(); }), HasSubstr("no rows"));
  EXPECT_THAT(refusal(
                  [](auto& o, auto&) {
                    o.parameters = {"a", "x0"};
                    o.points = 1'000'000;
                  },
                  absl::StatusCode::kResourceExhausted),
              HasSubstr("limit"));
}

TEST(CostGrid, EndsOnAStopRequest) {
  std::stop_source source;
  source.request_stop();
  EXPECT_EQ(EvaluateCostGrid(Resolve(RampProblem()), ThreeRows(), {}, Stop(source.get_token()))
                .status()
                .code(),
            absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace polyest::internal::studies_test
