// Tests problems that go on from an estimate.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/estimator/estimator_access.h"
#include "core/estimator/posterior/marginal_description.h"
#include "core/estimator/studies/experiment_design.h"
#include "tests/unit/core/estimator/studies/line_experiment.h"

namespace polyest::internal::line_experiment {
namespace {

// Returns the estimate from samples of the line with x_0 = 1, a = 2.
Estimate LineEstimate(const ResolvedProblem& problem, const std::vector<double>& time_s) {
  const auto estimator = EstimatorAccess::Make(problem).value();
  Samples samples;
  samples.time_s = time_s;
  samples.columns = {{"x", {}, {}}};
  for (const double t : time_s) samples.columns[0].value.push_back(1 + 2 * t);
  EXPECT_TRUE(estimator->Append(samples).ok());
  EXPECT_TRUE(estimator->Process().ok());
  return estimator->CurrentEstimate().value();
}

TEST(EstimateAsPrior, HasItsMeansAndCovariance) {
  const ResolvedProblem problem = Resolve(Line());
  const Estimate estimate = LineEstimate(problem, {0, 1, 2});
  const ResolvedProblem next = WithEstimateAsPrior(problem, estimate).value();
  const Prior& prior = next.prior();
  for (int i = 0; i < 2; ++i) {
    EXPECT_NEAR(prior.Mean()[i], estimate.parameters[static_cast<size_t>(i)].mean, 1e-12);
  }
  const Matrix jacobian = prior.Jacobian(Vector::Zero(2));
  EXPECT_TRUE((jacobian * jacobian.transpose()).isApprox(estimate.covariance, 1e-6));
}

TEST(EstimateAsPrior, MakesGainsOfOneExperimentAndTheNextAddUp) {
  const ResolvedProblem problem = Resolve(Line());
  const ResolvedProblem next =
      WithEstimateAsPrior(problem, LineEstimate(problem, {0, 1, 2})).value();
  ExperimentOptions options;
  options.until_s = 2;
  options.step_s = 1;
  const double first = DesignExperiment(problem, options, {})->gain.bits;
  const double second = DesignExperiment(next, options, {})->gain.bits;
  // Both experiments sample all of t = 0, 1, 2. The curvature is exact to rounding here.
  EXPECT_NEAR(first + second, LineBits(LineCovariance({0, 1, 2, 0, 1, 2})), 1e-4);
}

TEST(EstimateAsPrior, StaysWithinTheBounds) {
  Problem problem = Line();
  problem.uncertain = {Normal("x_0", 0, 2), UncertainParameter::Uniform("a", 0, 4).value()};
  const ResolvedProblem before = Resolve(problem);
  const ResolvedProblem wide = WithEstimateAsPrior(before, LineEstimate(before, {0.1})).value();
  EXPECT_EQ(wide.prior().parameters()[1].germ.family, GermFamily::kTruncatedNormal);
  // The rounding of mean + scale · germ at a bound is half a unit in the last place of its terms,
  // which are below 4.
  constexpr double kRounding = 4 * std::numeric_limits<double>::epsilon();
  for (const double score : {-30.0, 30.0}) {
    EXPECT_GE(wide.prior().OfScore(1, score), -kRounding);
    EXPECT_LE(wide.prior().OfScore(1, score), 4 + kRounding);
  }
  std::vector<double> many;
  for (int k = 0; k < 400; ++k) many.push_back(0.01 * k);
  const ResolvedProblem sharp = WithEstimateAsPrior(before, LineEstimate(before, many)).value();
  EXPECT_EQ(sharp.prior().parameters()[1].germ.family, GermFamily::kNormal);
}

TEST(EstimateAsPrior, KeepsTheBoundsOfALogUniformPrior) {
  Problem problem = Line();
  problem.uncertain = {Normal("x_0", 0, 2), UncertainParameter::LogUniform("a", 1, 3).value()};
  const ResolvedProblem before = Resolve(problem);
  const ResolvedProblem after = WithEstimateAsPrior(before, LineEstimate(before, {0.1})).value();
  EXPECT_NEAR(after.prior().OfScore(1, -30), 1, 1e-12);
  EXPECT_NEAR(after.prior().OfScore(1, 30), 3, 1e-12);
}

// What the estimate reports is the prior, and so is what the next experiment begins with: its gain
// is that without data.
TEST(EstimateAsPrior, IsThePriorWhereTheDataCouldNotBeUsed) {
  Problem problem = ProblemOf({.outputs = {{"y", "a + 0 * b"}}},
                              {UncertainParameter::Lognormal("a", 1, 2).value(),
                               UncertainParameter::Lognormal("b", 1, 0.5).value()});
  problem.correlations = {{"a", "b", 0.5}};
  problem.measured = {{"y", {.absolute = 0.3}}};
  const ResolvedProblem before = Resolve(problem);
  Estimate estimate;
  for (int i = 0; i < 2; ++i) {
    ParameterEstimate parameter;
    parameter.prior_mean = before.prior().Mean()[i];
    parameter.prior_std_dev = before.prior().StandardDeviation()[i];
    parameter.map = parameter.mean = 0.5;
    parameter.std_dev = parameter.posterior_std_dev = 0.1;
    estimate.parameters.push_back(parameter);
  }
  estimate.covariance = 0.01 * Matrix::Identity(2, 2);
  Findings findings;
  findings.power = 0.001;
  GoByPriorIfInaccurate(findings, before.prior(), estimate);
  const ResolvedProblem next = WithEstimateAsPrior(before, estimate).value();
  EXPECT_EQ(next.problem().uncertain[0].germ.family, GermFamily::kNormal);
  EXPECT_EQ(next.prior().factor(), before.prior().factor());
  ExperimentOptions options;
  options.until_s = 2;
  options.step_s = 1;
  EXPECT_EQ(DesignExperiment(next, options, {})->gain.bits,
            DesignExperiment(before, options, {})->gain.bits);
}

}  // namespace
}  // namespace polyest::internal::line_experiment
