// Tests the warnings of an estimate.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/estimator/problem/resolved_problem.h"
#include "core/model/lane_model.h"
#include "tests/testing/oscillator.h"
#include "tests/testing/records.h"
#include "tests/unit/core/estimator/estimation.h"

namespace polyest::internal {
namespace {

using ::testing::AllOf;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;

UncertainParameter Velocity(double lower, double upper) {
  return UncertainParameter::Uniform("v0", lower, upper).value();
}

const std::vector<double>& Times() {
  static const std::vector<double> times = {0.13, 0.31, 0.71, 1.2, 1.77, 2.25};
  return times;
}

TEST(Diagnostics, AreNoneWhenAllIsWell) {
  const Estimate estimate = EstimateOf(InitialVelocityProblem(Velocity(0, 2), 0.02),
                                       InitialVelocityRecord(Times(), 1.1, 0.02));
  EXPECT_THAT(estimate.diagnostics, ::testing::IsEmpty());
}

TEST(Diagnostics, NameABoundOfThePriorThatTheDataAskToPass) {
  for (const double truth : {0.2, 2.0}) {
    const Estimate estimate = EstimateOf(InitialVelocityProblem(Velocity(0.5, 1.5), 0.02),
                                         InitialVelocityRecord(Times(), truth, 0.02));
    EXPECT_THAT(Message(estimate, DiagnosticCode::kAtPriorBound),
                AllOf(HasSubstr("v0"), HasSubstr(truth < 1 ? "lower" : "upper")));
    EXPECT_NEAR(estimate.parameters[0].map, truth < 1 ? 0.5 : 1.5, 1e-6);
    EXPECT_GE(estimate.parameters[0].lower95, 0.5);
    EXPECT_LE(estimate.parameters[0].upper95, 1.5);
    ExpectFinite(estimate);
  }
}

TEST(Diagnostics, NameAnOutputWhoseResidualsAreFarAboveTheNoise) {
  std::vector<double> times;
  for (int k = 1; k <= 40; ++k) times.push_back(0.073 * k);
  const Samples samples = InitialVelocityRecord(times, 1.1, 0.02);
  const Estimate estimate = EstimateOf(InitialVelocityProblem(Velocity(0, 2), 0.002), samples);
  // The ratio is 10, within the sampling error of 40 residuals, 4/√80 = 45 %.
  const std::string message = Message(estimate, DiagnosticCode::kModelMisfit);
  EXPECT_THAT(message, HasSubstr("output x: residuals are"));
  EXPECT_NEAR(std::sqrt(estimate.channels[0].chi_squared / 40), 10, 4.5);
  EXPECT_FALSE(Has(EstimateOf(InitialVelocityProblem(Velocity(0, 2), 0.02), samples),
                   DiagnosticCode::kModelMisfit));
}

// The χ² of 200 residuals at a fifth of the noise is 8, to be told from 200 ± 20.
TEST(Diagnostics, NameAnOutputWhoseResidualsAreFarBelowTheNoise) {
  std::vector<double> times;
  for (int k = 1; k <= 200; ++k) times.push_back(0.073 * k);
  const Samples samples = InitialVelocityRecord(times, 1.1, 0.02);
  const Estimate estimate = EstimateOf(InitialVelocityProblem(Velocity(0, 2), 0.1), samples);
  EXPECT_THAT(Message(estimate, DiagnosticCode::kModelMisfit),
              HasSubstr("output x: residuals are only 0.2"));
  const Samples few = InitialVelocityRecord(Times(), 1.1, 0.0);
  EXPECT_FALSE(Has(EstimateOf(InitialVelocityProblem(Velocity(0, 2), 0.02), few),
                   DiagnosticCode::kModelMisfit));
}

// Estimates a from samples of y = a².
struct Square {
  static constexpr int kStates = 0;
  static constexpr int kParameters = 1;
  static constexpr int kInputs = 0;
  static constexpr int kOutputs = 1;

  static ModelDescription Describe() {
    ModelDescription description;
    description.name = "square";
    description.parameters = {{"a", "1", "root"}};
    description.outputs = {{"y", "1", "square"}};
    return description;
  }
  template <class Real>
  static void Outputs(double, const std::array<Real, kStates>&,
                      const std::array<Real, kParameters>& parameters,
                      const std::array<Real, kInputs>&, std::array<Real, kOutputs>& outputs) {
    outputs[0] = parameters[0] * parameters[0];
  }
};

TEST(Diagnostics, NameTheOtherMinimum) {
  Problem problem;
  problem.model = std::make_shared<LaneModel<Square>>();
  problem.uncertain = {UncertainParameter::Uniform("a", -1.5, 1).value()};
  problem.measured = {{"y", {.absolute = 0.01}}};
  Samples samples;
  samples.time_s = {0, 1, 2};
  samples.columns = {{"y", {0.64, 0.65, 0.63}, {}}};
  const Estimate estimate = EstimateOf(problem, samples);
  EXPECT_NEAR(std::abs(estimate.parameters[0].map), 0.8, 1e-3);
  EXPECT_THAT(Message(estimate, DiagnosticCode::kMultipleMinima),
              HasSubstr(estimate.parameters[0].map > 0 ? "a = -0.8" : "a = 0.8"));
  // The range covers both pieces of the posterior.
  EXPECT_NEAR(estimate.parameters[0].lower95, -0.8, 0.05);
  EXPECT_NEAR(estimate.parameters[0].upper95, 0.8, 0.05);
  // Each piece is narrow, but both together are wider than the prior.
  EXPECT_LT(estimate.parameters[0].contraction, 0.05);
  EXPECT_EQ(estimate.parameters[0].verdict, Verdict::kWeak);
}

TEST(Diagnostics, SayThatAFixedExpansionIsInaccurateAndHoldTheTruth) {
  testing::OscillatorTruth truth;
  const Samples record = testing::OscillatorRecord(20, 52, truth);
  const testing::LeastSquares exact = testing::FitOscillator(record, truth);
  const Estimate estimate =
      testing::EstimateInBatches(testing::OscillatorProblem(3, /*adaptive=*/false), record, 1000);
  EXPECT_THAT(Message(estimate, DiagnosticCode::kExpansionInaccurate),
              AllOf(HasSubstr("order 3"), HasSubstr("or let it be adaptive")));
  EXPECT_GT(std::abs(estimate.parameters[0].map - exact.k), 3 * exact.k_std_dev);
  const double values[] = {exact.k, exact.c};
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_GT(values[i], estimate.parameters[i].lower95) << estimate.parameters[i].name;
    EXPECT_LT(values[i], estimate.parameters[i].upper95) << estimate.parameters[i].name;
  }
}

// Makes ẍ = −x − k3 x³ from x = 1, which runs away in finite time where k3 < −1.
Problem SofteningSpring() {
  Problem problem;
  problem.model = *FindBuiltinModel("duffing");
  problem.fixed = {{"c", 0}, {"x0", 1}};
  problem.uncertain = {UncertainParameter::Uniform("k3", -2, 1).value()};
  problem.measured = {{"x", {.absolute = 0.02}}};
  problem.expansion.order = 3;
  problem.expansion.points_per_term = 4;
  return problem;
}

Samples SofteningRecord(double k3, const std::vector<double>& times) {
  const ResolvedProblem problem = ResolvedProblem::Make(SofteningSpring()).value();
  const InputSignals inputs = problem.MakeInputs();
  EnsemblePropagator model(problem.MakeEnsemble(Matrix::Constant(1, 1, k3), {0}, 1), &inputs);
  Matrix outputs(1, static_cast<Eigen::Index>(times.size()));
  EXPECT_TRUE(model.Advance(times, outputs, {}).ok());
  Samples samples;
  samples.time_s = times;
  samples.columns = {{"x", {outputs.data(), outputs.data() + outputs.size()}, {}}};
  return samples;
}

TEST(Diagnostics, DescribeTrajectoriesThatCouldNotBeIntegrated) {
  Problem problem = SofteningSpring();
  problem.expansion.adaptive = false;
  const Estimate estimate = EstimateOf(problem, SofteningRecord(0.4, {4, 5, 6}));
  EXPECT_THAT(Message(estimate, DiagnosticCode::kPointsFailed),
              AllOf(ContainsRegex("^[1-9] of 16 trajectories could not be integrated"),
                    ContainsRegex("k3 = -[12]\\.[0-9]* at t = [0-9.]* s \\(run 0\\)"),
                    HasSubstr("solver flag")));
  ExpectFinite(estimate);
}

// The expansion leaves behind the part of the prior that runs away when it moves.
TEST(Diagnostics, SurviveTrajectoriesThatCouldNotBeIntegrated) {
  std::vector<double> times;
  for (int k = 1; k <= 60; ++k) times.push_back(0.1 * k);
  const Samples record = SofteningRecord(-0.4, times);
  const Estimate whole = testing::EstimateInBatches(SofteningSpring(), record, 100);
  ExpectFinite(whole);
  EXPECT_NEAR(whole.parameters[0].map, -0.4, whole.parameters[0].std_dev);
  EXPECT_GT(whole.parameters[0].lower95, -1);
  ExpectSame(testing::EstimateInBatches(SofteningSpring(), record, 1), whole);
  ExpectSame(testing::EstimateInBatches(SofteningSpring(), record, 7), whole);
}

TEST(Diagnostics, OfABatchedRecordNameTheSameFailures) {
  Problem problem = SofteningSpring();
  problem.expansion.adaptive = false;
  std::vector<double> times;
  for (int k = 1; k <= 60; ++k) times.push_back(0.1 * k);
  const Samples record = SofteningRecord(0.4, times);
  const Estimate whole = testing::EstimateInBatches(problem, record, 100);
  EXPECT_TRUE(Has(whole, DiagnosticCode::kPointsFailed));
  ExpectSame(testing::EstimateInBatches(problem, record, 1), whole);
}

// Too few trajectories survive from the first sample on.
TEST(Diagnostics, OfAModelThatFailsEverywhereAreRefusedWithTheReason) {
  Problem problem = SofteningSpring();
  problem.uncertain = {UncertainParameter::Uniform("k3", -4, -2).value()};
  const auto estimator = MakeEstimator(problem);
  Samples samples;
  samples.time_s = {5};
  samples.columns = {{"x", {0}, {}}};
  ASSERT_TRUE(estimator->Append(samples).ok());
  for (int attempt = 0; attempt < 2; ++attempt) {
    const absl::Status status = estimator->Process();
    EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
    EXPECT_THAT(std::string(status.message()),
                AllOf(HasSubstr("only 0 of 16 trajectories could be integrated to t = 5 s"),
                      HasSubstr("k3 = ")));
    EXPECT_EQ(estimator->rows_processed(), 0);
  }
}

}  // namespace
}  // namespace polyest::internal
