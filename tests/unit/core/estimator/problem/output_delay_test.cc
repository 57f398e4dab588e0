// The delay of a measured output: sample(t) = gain · x(t − delay) + offset + noise.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>

#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/sample_checks.h"
#include "tests/testing/records.h"
#include "tests/unit/core/estimator/estimation.h"

namespace polyest::internal {
namespace {

using testing::EstimateInBatches;
using ::testing::HasSubstr;

constexpr double kForceFrequency = 2 * std::numbers::pi * 1.3;
constexpr double kStiffness = 25;
constexpr double kDelay_s = 0.007;
constexpr double kErrorOfSamples = 1e-4;

// ẍ + k x = sin Ωt from rest: x = (sin Ωt − (Ω/ω) sin ωt)/(ω² − Ω²) with ω² = k.
double DrivenDisplacement(double t) {
  const double omega = std::sqrt(kStiffness);
  return (std::sin(kForceFrequency * t) - kForceFrequency / omega * std::sin(omega * t)) /
         (kStiffness - kForceFrequency * kForceFrequency);
}

Problem LateProblem() {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.fixed = {{"m", 1}, {"c", 0}, {"x0", 0}, {"v0", 0}};
  problem.uncertain = {UncertainParameter::Uniform("k", 20, 30).value(),
                       UncertainParameter::Uniform("x.delay", 0, 0.02).value()};
  problem.inputs = {{"force", StreamedInput{}}};
  problem.measured = {{"x", {.absolute = kErrorOfSamples}}};
  return problem;
}

// x at 1 kHz, the force at 95 Hz; each shows what was so long before.
Samples LateRecord(double until_s, double late_s = kDelay_s, double force_late_s = 0) {
  std::map<double, bool> times;  // whether x is sampled
  for (int k = 0; 0.001 * k <= until_s; ++k) times[0.001 * k] = true;
  for (int k = 0; k / 95.0 <= until_s; ++k) times.try_emplace(k / 95.0, false);
  std::mt19937_64 generator(11);
  std::normal_distribution<double> normal(0, kErrorOfSamples);
  Samples samples;
  samples.columns = {{"x", {}, {}}, {"force", {}, {}}};
  int next_force = 0;
  for (const auto& [t, sampled] : times) {
    samples.time_s.push_back(t);
    samples.columns[0].value.push_back(DrivenDisplacement(std::max(0.0, t - late_s)) +
                                       normal(generator));
    samples.columns[0].missing.push_back(!sampled);
    const bool forced = t == next_force / 95.0;
    next_force += forced ? 1 : 0;
    samples.columns[1].value.push_back(std::sin(kForceFrequency * std::max(0.0, t - force_late_s)));
    samples.columns[1].missing.push_back(!forced);
  }
  samples.end_of_run = true;
  return samples;
}

TEST(OutputDelay, IsFoundBesideTheStiffness) {
  const Estimate estimate = EstimateOf(LateProblem(), LateRecord(2));
  const ParameterEstimate& k = estimate.parameters[0];
  const ParameterEstimate& delay = estimate.parameters[1];
  EXPECT_NEAR(k.mean, kStiffness, 2 * k.std_dev);
  EXPECT_NEAR(delay.mean, kDelay_s, 2 * delay.std_dev);
  EXPECT_LT(delay.std_dev, 1e-4);
  EXPECT_NEAR(estimate.channels[0].chi_squared, 1981, 4 * std::sqrt(2 * 1981));
}

// The record shows nonsense for a fifth of a second, which a column tells. By hand the force is
// interpolated to the times of x, x is moved by the delay that is known, and the nonsense left out.
TEST(OutputDelay, AgreesWithDataResampledByHand) {
  const auto nonsense = [](double t) { return t > 0.8 && t < 1; };
  Problem problem = LateProblem();
  problem.use_when = "ok > 0.5";
  Samples record = LateRecord(2), by_hand;
  by_hand.columns = {{"x", {}, {}}, {"force", {}, {}}};
  record.columns.push_back({"ok", {}, {}});
  for (size_t k = 0; k < record.rows(); ++k) {
    const double t = record.time_s[k];
    double& x = record.columns[0].value[k];
    record.columns[2].value.push_back(nonsense(t) ? 0 : 1);
    if (!record.columns[0].missing[k] && t >= kDelay_s) {
      by_hand.time_s.push_back(t - kDelay_s);
      by_hand.columns[0].value.push_back(x);
      by_hand.columns[0].missing.push_back(nonsense(t));
      by_hand.columns[1].value.push_back(std::sin(kForceFrequency * (t - kDelay_s)));
    }
    if (nonsense(t)) x += 0.1;
  }
  by_hand.end_of_run = true;
  Problem simple = LateProblem();
  simple.uncertain.pop_back();
  const ParameterEstimate found = EstimateOf(problem, record).parameters[0];
  const ParameterEstimate expected = EstimateOf(simple, by_hand).parameters[0];
  EXPECT_NEAR(found.mean, kStiffness, 2 * found.std_dev);
  EXPECT_NEAR(found.mean, expected.mean, 0.5 * expected.std_dev);
  EXPECT_NEAR(found.std_dev / expected.std_dev, 1, 0.2);
}

TEST(OutputDelay, GivesTheSameBitsForAnyBatches) {
  const Samples record = LateRecord(0.3);
  const Estimate whole = EstimateInBatches(LateProblem(), record, 1000);
  ExpectSame(EstimateInBatches(LateProblem(), record, 1), whole);
  ExpectSame(EstimateInBatches(LateProblem(), record, 37), whole);
}

// A fixed delay of the output is the same as a later record.
TEST(OutputDelay, MayBeFixed) {
  Problem problem = LateProblem();
  problem.uncertain.pop_back();
  problem.fixed["x.delay"] = kDelay_s;
  const ParameterEstimate k = EstimateOf(problem, LateRecord(2)).parameters[0];
  EXPECT_NEAR(k.mean, kStiffness, 2 * k.std_dev);
  problem.fixed["x.delay"] = 0;
  const ParameterEstimate without = EstimateOf(problem, LateRecord(2)).parameters[0];
  EXPECT_GT(std::abs(without.map - kStiffness), 10 * k.std_dev);
}

TEST(OutputDelay, MayBeNegativeWithoutStreamedInputs) {
  Problem problem =
      InitialVelocityProblem(UncertainParameter::Uniform("v0", 0.5, 1.5).value(), 1e-3);
  problem.uncertain.push_back(UncertainParameter::Uniform("x.delay", -0.05, 0.05).value());
  Samples samples;
  samples.columns = {{"x", {}, {}}};
  std::mt19937_64 generator(3);
  std::normal_distribution<double> normal(0, 1e-3);
  for (int k = 0; k < 200; ++k) {
    samples.time_s.push_back(0.02 * k);
    samples.columns[0].value.push_back(1.1 * UnitResponse(0.02 * k + 0.03) + normal(generator));
  }
  const Estimate estimate = EstimateOf(problem, samples);
  EXPECT_NEAR(estimate.parameters[0].mean, 1.1, 2 * estimate.parameters[0].std_dev);
  EXPECT_NEAR(estimate.parameters[1].mean, -0.03, 2 * estimate.parameters[1].std_dev);
  EXPECT_LT(estimate.parameters[1].std_dev, 1e-3);
  EXPECT_EQ(estimate.samples, 200 - 3);  // not those at 0, 0.02 and 0.04 s
}

std::string RefusalOfDelay(const UncertainParameter& delay) {
  Problem problem = LateProblem();
  problem.uncertain[1] = delay;
  return std::string(ResolvedProblem::Make(problem).status().message());
}

// The force is recorded late: its recorded values from then on are those that the mass feels now.
Problem LateForceProblem() {
  Problem problem = LateProblem();
  problem.uncertain[1] = UncertainParameter::Uniform("force.delay", -0.02, 0.02).value();
  return problem;
}

TEST(OutputDelay, OfAStreamedInputMayBeNegative) {
  const Estimate estimate = EstimateOf(LateForceProblem(), LateRecord(2, 0, kDelay_s));
  EXPECT_NEAR(estimate.parameters[0].mean, kStiffness, 2 * estimate.parameters[0].std_dev);
  EXPECT_NEAR(estimate.parameters[1].mean, -kDelay_s, 2 * estimate.parameters[1].std_dev);
  EXPECT_LT(estimate.parameters[1].std_dev, 2e-4);
}

TEST(OutputDelay, MayBeNegativeWithStreamedInputs) {
  Problem problem = LateProblem();
  problem.uncertain[1] = UncertainParameter::Uniform("x.delay", -0.02, 0.02).value();
  const Estimate estimate = EstimateOf(problem, LateRecord(2, -kDelay_s));
  EXPECT_NEAR(estimate.parameters[0].mean, kStiffness, 2 * estimate.parameters[0].std_dev);
  EXPECT_NEAR(estimate.parameters[1].mean, -kDelay_s, 2 * estimate.parameters[1].std_dev);
  EXPECT_LT(estimate.parameters[1].std_dev, 2e-4);
}

// The samples of the last 20 ms before the last of the force's would need forces after it.
TEST(OutputDelay, LeavesOutWhatIsAfterTheInputs) {
  const Samples record = LateRecord(2, 0, kDelay_s);
  const double last_force_s = 190 / 95.0;
  int64_t used = 0;
  for (size_t k = 0; k < record.rows(); ++k) {
    used += !record.columns[0].missing[k] && record.time_s[k] <= last_force_s - 0.02 ? 1 : 0;
  }
  EXPECT_EQ(EstimateOf(LateForceProblem(), record).samples, used);
}

TEST(OutputDelay, GivesTheSameBitsForAnyBatchesWithNegativeDelays) {
  const Samples record = LateRecord(0.3, 0, kDelay_s);
  const Estimate whole = EstimateInBatches(LateForceProblem(), record, 1000);
  ExpectSame(EstimateInBatches(LateForceProblem(), record, 1), whole);
  ExpectSame(EstimateInBatches(LateForceProblem(), record, 37), whole);
}

// Samples wait as long as the prior allows.
TEST(OutputDelay, WaitsForTheInputsThatSamplesNeed) {
  Samples record = LateRecord(0.3, 0, kDelay_s);
  record.end_of_run = false;
  const auto estimator = Estimator::Make(LateForceProblem()).value();
  ASSERT_TRUE(estimator->Append(record).ok());
  ASSERT_TRUE(estimator->Process().ok());
  // The curve through the forces is settled up to one that so many others follow.
  const int needed = ResolvedProblem::Make(LateForceProblem())->knots_needed().front();
  const double known_to_s = (29 - needed) / 95.0;
  const auto settled =
      std::ranges::count_if(record.time_s, [&](double t) { return t + 0.02 <= known_to_s; });
  EXPECT_EQ(estimator->rows_processed(), settled);
}

TEST(OutputDelay, MustBeBounded) {
  EXPECT_THAT(RefusalOfDelay(UncertainParameter::Normal("x.delay", 0.01, 0.001).value()),
              HasSubstr("uncertain[1]: the delay x.delay of an output needs bounds"));
  EXPECT_THAT(RefusalOfDelay(UncertainParameter::Normal("force.delay", 0.01, 0.001).value()),
              HasSubstr("uncertain[1]: the delay force.delay of a streamed input needs a lower"));
  Problem problem = LateProblem();
  problem.derived = {{"x.delay", "0.001*k"}};
  problem.uncertain.pop_back();
  EXPECT_THAT(std::string(ResolvedProblem::Make(problem).status().message()),
              HasSubstr("a delay cannot be derived"));
}

// Before the largest delay that the prior allows, the sensor shows what was before the run.
TEST(OutputDelay, LeavesOutWhatWasBeforeTheRun) {
  const ResolvedProblem problem = ResolvedProblem::Make(LateProblem()).value();
  const CheckedSamples checked = SampleChecks(problem).Check(LateRecord(0.03)).value();
  for (size_t k = 0; k < checked.rows.size(); ++k) {
    if (checked.rows[k].time_s < 0.02) {
      EXPECT_TRUE(std::isnan(checked.values[2 * k]));
      EXPECT_EQ(checked.noise[k], 0);
    }
  }
  EXPECT_FALSE(std::isnan(checked.values[2 * (checked.rows.size() - 1)]));
}

}  // namespace
}  // namespace polyest::internal
