#include "core/estimator/studies/cost_grid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/core/estimator/studies/ramp.h"

namespace polyest::internal::ramp {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

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
}  // namespace polyest::internal::ramp
