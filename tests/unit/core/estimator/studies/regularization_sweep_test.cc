#include "core/estimator/studies/regularization_sweep.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::regularization_sweep_test {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

UncertainParameter Normal(const char* name) {
  return UncertainParameter::Normal(name, 0, 1).value();
}

// Gives the problem the paper's expansion, over the whole prior.
Problem Fixed(Problem problem) {
  problem.expansion.adaptive = false;
  return problem;
}

// The problem has one output y = h·θ measured once, with unit normal priors, |h|² = h², noise σ:
//   θ̂ = h z/(h² + α²σ²),  covariance (α² + h hᵀ/σ²)⁻¹, no direction above the prior's 1,
//   p(z | α²) = N(z; 0, σ² + h²/α²),  γ = h²/(h² + α²σ²).
TEST(RegularizationSweep, OfALinearProblemIsItsClosedForm) {
  const double noise = 0.3, z = 2;
  const Eigen::Vector3d h(1, 2, -1);
  const double h2 = h.squaredNorm(), variance = noise * noise;
  const auto estimator = Processed(
      Fixed(TextProblem("a + 2*b - c", {Normal("a"), Normal("b"), Normal("c")}, noise)), {z});
  RegularizationOptions options;
  options.lowest = 0.01;
  options.highest = 1000;
  options.points = 11;
  const RegularizationSweep sweep = estimator->CurrentRegularizationSweep(options).value();
  EXPECT_THAT(sweep.parameters, testing::ElementsAre("a", "b", "c"));
  EXPECT_EQ(sweep.regularization, 1);
  ASSERT_EQ(sweep.points.size(), 11u);
  const auto log_evidence = [&](double r) {
    const double spread = variance + h2 / r;
    return -0.5 * (std::log(spread) + z * z / spread);
  };
  double greatest = -1e9;
  for (const auto& point : sweep.points) {
    greatest = std::max(greatest, log_evidence(point.regularization));
  }
  for (size_t k = 0; k < sweep.points.size(); ++k) {
    const RegularizationPoint& point = sweep.points[k];
    const double r = point.regularization;
    EXPECT_NEAR(r, std::pow(10, -2 + 0.5 * static_cast<double>(k)), 1e-9 * r);
    EXPECT_TRUE(point.converged);
    const Eigen::Vector3d map = h * z / (h2 + r * variance);
    EXPECT_LT((point.map - map).norm(), 1e-6);
    EXPECT_NEAR(point.cost.mismatch, std::pow((z - h.dot(map)) / noise, 2) / 2, 1e-6);
    EXPECT_NEAR(point.cost.prior, map.squaredNorm() / 2 + 1.5 * std::log(2 * M_PI), 1e-6);
    EXPECT_NEAR(point.effective_parameters, h2 / (h2 + r * variance), 1e-9);
    EXPECT_NEAR(point.log_evidence, log_evidence(r) - greatest, 1e-6);
    const double along = std::min(1.0, 1 / (r + h2 / variance)), across = std::min(1.0, 1 / r);
    for (int i = 0; i < 3; ++i) {
      const double share = h[i] * h[i] / h2;
      EXPECT_NEAR(point.std_dev[i], std::sqrt(along * share + across * (1 - share)), 1e-6);
    }
  }
  // The evidence is greatest where z² = σ² + h²/α². The discrepancy is met there too, by chance:
  // (α²σ²/(h² + α²σ²))² z²/σ² = 1 − γ = α²σ²/(h² + α²σ²).
  const double best = h2 / (z * z - variance);
  EXPECT_TRUE(sweep.evidence.determined);
  EXPECT_NEAR(sweep.evidence.regularization, best, 1e-3 * best);
  EXPECT_TRUE(sweep.discrepancy.determined);
  EXPECT_NEAR(sweep.discrepancy.regularization, best, 1e-3 * best);
  EXPECT_FALSE(sweep.l_curve.determined);  // The datum can be met exactly.
}

// An adapted expansion lies where the posterior is. A heavy prior pulls the estimate out of it.
TEST(RegularizationSweep, LeavesOutWeightsThatPullTheEstimateOutOfTheExpansion) {
  const double noise = 0.01;
  const std::vector<double> values(20, 2.5);
  const auto estimator = Processed(TextProblem("exp(a)", {Normal("a")}, noise), values);
  RegularizationOptions options;
  options.highest = 1e8;
  const RegularizationSweep sweep = estimator->CurrentRegularizationSweep(options).value();
  ASSERT_GT(sweep.points.size(), 16u);
  EXPECT_LT(sweep.points.front().regularization, 1.001e-4);
  EXPECT_LT(sweep.points.back().regularization, 1e7);  // The θ̂ of that weight would be 0.1.
  for (const RegularizationPoint& point : sweep.points) {
    // The oracle solves J′ = N (y − z) y/σ² + α² a = 0 with y = e^a by Newton's method.
    const double weight = 20 / (noise * noise);
    double a = std::log(2.5);
    for (int i = 0; i < 50; ++i) {
      const double y = std::exp(a);
      a -= (weight * (y - 2.5) * y + point.regularization * a) /
           (weight * (2 * y - 2.5) * y + point.regularization);
    }
    // The expansion may be off by a tenth of the noise of one of the 20 samples.
    EXPECT_NEAR(point.map[0], a, 0.5 * point.std_dev[0]) << point.regularization;
  }
}

TEST(RegularizationSweep, OfUniformPriorsHasNoEvidenceForAnyWeight) {
  const auto uniform = UncertainParameter::Uniform("a", -1, 1).value();
  const auto estimator = Processed(Fixed(TextProblem("a", {uniform}, 0.1)), {0.3});
  const RegularizationSweep sweep = estimator->CurrentRegularizationSweep({}).value();
  ASSERT_EQ(sweep.points.size(), 33u);
  for (const RegularizationPoint& point : sweep.points) {
    EXPECT_NEAR(point.log_evidence, 0, 1e-9);
    EXPECT_NEAR(point.map[0], 0.3, 1e-6);
  }
  for (const auto& choice : {sweep.l_curve, sweep.discrepancy, sweep.evidence}) {
    EXPECT_FALSE(choice.determined);
    EXPECT_EQ(choice.regularization, 1);
    EXPECT_EQ(choice.reason, "every prior is uniform, and α² has no effect on those");
  }
}

TEST(RegularizationSweep, KnowsNoDiscrepancyWithANoiseOfUnknownSize) {
  Problem problem = TextProblem("a", {Normal("a")}, 0);
  problem.measured[0].noise = {.unknown = true};
  std::vector<double> values;
  for (int i = 0; i < 40; ++i) values.push_back(0.8 + 0.1 * std::sin(7.0 * i * i));
  const auto estimator = Processed(problem, values);
  const RegularizationSweep sweep = estimator->CurrentRegularizationSweep({}).value();
  EXPECT_FALSE(sweep.discrepancy.determined);
  EXPECT_EQ(sweep.discrepancy.reason, "the noise of output y is of unknown size");
}

TEST(RegularizationSweep, StopsWhenAsked) {
  Problem problem = Fixed(TextProblem("a", {Normal("a")}, 0.1));
  problem.regularization_mode = RegularizationMode::kEvidence;
  const auto estimator = Processed(problem, {1});
  std::stop_source source;
  source.request_stop();
  const Stop stop(source.get_token());
  EXPECT_TRUE(absl::IsCancelled(estimator->CurrentRegularizationSweep({}, stop).status()));
  EXPECT_TRUE(absl::IsCancelled(estimator->CurrentEstimate(stop).status()));
}

TEST(RegularizationOptions, NameFieldValueAndRule) {
  RegularizationOptions options;
  EXPECT_TRUE(options.Validate().ok());
  options.lowest = -1;
  EXPECT_EQ(options.Validate().message(), "lowest: -1 must be from 1e-08 to 1e+08");
  options.lowest = 1;
  options.highest = std::nan("");
  EXPECT_EQ(options.Validate().message(), "highest: nan must be from 1e-08 to 1e+08");
  options.highest = 0.5;
  EXPECT_EQ(options.Validate().message(), "lowest: 1 must be below highest, 0.5");
  options = {};
  options.points = 1;
  EXPECT_EQ(options.Validate().message(), "points: 1 must be from 2 to 1001");
}

Estimate EstimateBy(RegularizationMode mode, double noise, const std::vector<double>& values) {
  Problem problem = Fixed(TextProblem("a", {Normal("a")}, noise));
  problem.regularization_mode = mode;
  return Processed(problem, values)->CurrentEstimate().value();
}

// The datum z = 2 with s = 1/σ = 10 gives α² = s²/(s² z² − 1) and θ̂ = s² z/(s² + α²).
TEST(EstimateWithARule, TakesTheWeightAndReportsTheBias) {
  const double expected = 100.0 / 399;
  for (const RegularizationMode mode :
       {RegularizationMode::kEvidence, RegularizationMode::kDiscrepancy}) {
    const Estimate estimate = EstimateBy(mode, 0.1, {2});
    EXPECT_NEAR(estimate.regularization, expected, 1e-3 * expected);
    const double r = estimate.regularization;
    EXPECT_NEAR(estimate.parameters[0].map, 200 / (100 + r), 1e-6);
    EXPECT_NEAR(estimate.parameters[0].bias, 200 / (100 + r) - 200.0 / 101, 1e-6);
    EXPECT_NEAR(estimate.parameters[0].std_dev, 1 / std::sqrt(100 + r), 1e-6);
    EXPECT_FALSE(Has(estimate, DiagnosticCode::kRegularizationNotDetermined));
  }
}

TEST(EstimateWithARule, SaysWhyBayesRuleStandsWhereTheRuleDoesNotChoose) {
  for (const auto& [mode, reason] :
       {std::pair{RegularizationMode::kLCurve, "the L-curve has no corner"},
        {RegularizationMode::kDiscrepancy, "the noise explains the mismatch up to α² = 1e+04"},
        {RegularizationMode::kEvidence, "the data are about as probable with α² = 1e+04"}}) {
    const Estimate estimate = EstimateBy(mode, 0.1, {0.05});
    EXPECT_EQ(estimate.regularization, 1);
    EXPECT_EQ(estimate.parameters[0].bias, 0);
    EXPECT_THAT(Message(estimate, DiagnosticCode::kRegularizationNotDetermined), HasSubstr(reason));
  }
}

TEST(EstimateWithARule, OfFixedWeightHasTheBiasOfTheClosedForm) {
  Problem problem = TextProblem("a", {Normal("a")}, 0.1);
  problem.regularization = 100;
  const Estimate estimate = Processed(problem, {1.5})->CurrentEstimate().value();
  EXPECT_EQ(estimate.regularization, 100);
  EXPECT_NEAR(estimate.parameters[0].bias, 150.0 / 200 - 150.0 / 101, 1e-4);
}

TEST(EstimateWithARule, RefusesTheDiscrepancyOfANoiseOfUnknownSize) {
  Problem problem = TextProblem("a", {Normal("a")}, 0.1);
  problem.regularization_mode = RegularizationMode::kDiscrepancy;
  EXPECT_TRUE(ResolvedProblem::Make(problem).ok());
  problem.measured[0].noise = {.unknown = true};
  const absl::Status status = ResolvedProblem::Make(problem).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(status.message()), AllOf(StartsWith("regularization_mode: DISCREPANCY"),
                                                   HasSubstr("measured[0].noise (y) is unknown")));
}

}  // namespace
}  // namespace polyest::internal::regularization_sweep_test
