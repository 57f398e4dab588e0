// Tests the warnings of suspicious data in estimates.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/unit/core/estimator/snapshot_session.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

std::vector<std::string> Warnings(const Estimate& estimate) {
  std::vector<std::string> messages;
  for (const Diagnostic& diagnostic : estimate.diagnostics) {
    if (diagnostic.code == DiagnosticCode::kSuspiciousData) messages.push_back(diagnostic.message);
  }
  return messages;
}

std::vector<std::string> WarningsOf(const Problem& problem, const Samples& samples) {
  return Warnings(EstimateOf(problem, samples));
}

// Returns `count` times from `first` on, 0.05 s apart.
std::vector<double> TimesFrom(double first, int count) {
  std::vector<double> times;
  for (int k = 0; k < count; ++k) times.push_back(first + 0.05 * k);
  return times;
}

// Makes the oscillator's problem with v0 in (0.5, 1.5) m/s.
Problem VelocityProblem(double noise = 0.01) {
  return InitialVelocityProblem(UncertainParameter::Uniform("v0", 0.5, 1.5).value(), noise);
}

// Makes the oscillator's problem with a streamed force.
Problem ForcedProblem() {
  Problem problem = VelocityProblem();
  problem.inputs = {{"force", StreamedInput{.interpolation = Interpolation::kLinear}}};
  return problem;
}

Samples ForcedRecord(const std::vector<double>& times) {
  Samples samples = InitialVelocityRecord(times, 1.1, 0.01);
  samples.columns.push_back({"force", {}, {}});
  // A force far too small to move the mass, but not constant.
  for (const double t : times) samples.columns[1].value.push_back(1e-6 * std::cos(t));
  samples.end_of_run = true;
  return samples;
}

TEST(SuspiciousData, AreNoneInAGoodRecord) {
  EXPECT_THAT(WarningsOf(VelocityProblem(), InitialVelocityRecord(TimesFrom(0.05, 60), 1.1, 0.01)),
              IsEmpty());
  EXPECT_THAT(WarningsOf(ForcedProblem(), ForcedRecord(TimesFrom(0, 60))), IsEmpty());
}

// Returns a record of a motion that began at 12 s, with the times of the logger.
Samples CutOutRecord(int rows) {
  Samples samples = InitialVelocityRecord(TimesFrom(0.595, rows), 1.1, 0.01);
  samples.time_s = TimesFrom(12.345, rows);
  return samples;
}

// The motion itself is right if it began at 0 indeed.
TEST(SuspiciousData, AreTimesThatDoNotBeginNearZeroWhereTheModelDoesNotExplainTheSamples) {
  EXPECT_THAT(
      WarningsOf(VelocityProblem(), InitialVelocityRecord(TimesFrom(12.345, 60), 1.1, 0.01)),
      IsEmpty());
  EXPECT_THAT(WarningsOf(VelocityProblem(), CutOutRecord(60)),
              ElementsAre(AllOf(HasSubstr("t does not begin near 0"), HasSubstr("t = 12.345 s"),
                                HasSubstr("(x0, v0)"))));
}

TEST(SuspiciousData, AreFirstSamplesAwayFromAFixedInitialState) {
  Samples samples = InitialVelocityRecord(TimesFrom(0, 60), 1.1, 0.01);
  for (size_t k = 0; k < samples.rows(); ++k) {
    samples.columns[0].value[k] += 0.2 * std::cos(2 * std::numbers::pi * samples.time_s[k]);
  }
  EXPECT_THAT(WarningsOf(VelocityProblem(), samples),
              ElementsAre(AllOf(HasSubstr("its first sample"), HasSubstr("(x0, v0) uncertain"))));
  Problem uncertain = VelocityProblem();
  uncertain.uncertain.push_back(UncertainParameter::Normal("x0", 0, 0.5).value());
  EXPECT_THAT(WarningsOf(uncertain, samples), IsEmpty());
}

TEST(SuspiciousData, AreGapsOfAStreamedInputOnly) {
  std::vector<double> times = TimesFrom(0, 30);
  for (const double t : TimesFrom(2.1, 30)) times.push_back(t);  // 0.65 s after the last
  EXPECT_THAT(WarningsOf(ForcedProblem(), ForcedRecord(times)),
              ElementsAre(AllOf(HasSubstr("1 gap of more than 10 usual steps"),
                                HasSubstr("is 0.65 s, after t = 1.45 s"), HasSubstr("perRun"))));
  EXPECT_THAT(WarningsOf(VelocityProblem(), InitialVelocityRecord(times, 1.1, 0.01)), IsEmpty());
}

// A force with so many samples a period, too small to move the mass.
std::vector<std::string> WarningsOfForce(double per_period, Interpolation interpolation) {
  Problem problem = VelocityProblem();
  problem.inputs = {{"force", StreamedInput{.interpolation = interpolation}}};
  const std::vector<double> times = TimesFrom(0, 100);
  Samples samples = ForcedRecord(times);
  for (size_t k = 0; k < times.size(); ++k) {
    samples.columns[1].value[k] = 1e-6 * std::sin(2 * std::numbers::pi * k / per_period);
  }
  return WarningsOf(problem, samples);
}

// Straight lines between 10 samples a period lose (2π/10)²/12 = 3.3 % of a sine.
TEST(SuspiciousData, AreInputsWithTooFewSamplesForTheirInterpolation) {
  EXPECT_THAT(WarningsOfForce(10, Interpolation::kLinear),
              ElementsAre(AllOf(HasSubstr("about 10 samples"), HasSubstr("lose 3.3 %"))));
  EXPECT_THAT(WarningsOfForce(20, Interpolation::kLinear), IsEmpty());
  EXPECT_THAT(WarningsOfForce(3.3, Interpolation::kCubic),
              ElementsAre(AllOf(HasSubstr("about 3.3 samples"), HasSubstr("is a guess"))));
  EXPECT_THAT(WarningsOfForce(10, Interpolation::kCubic), IsEmpty());
  EXPECT_THAT(WarningsOfForce(3.3, Interpolation::kHold), IsEmpty());
}

TEST(SuspiciousData, AreNoSamplesAfterTheLargestDelayThatThePriorAllows) {
  Problem problem = VelocityProblem();
  problem.uncertain.push_back(UncertainParameter::Uniform("x.delay", 0, 5).value());
  EXPECT_THAT(WarningsOf(problem, InitialVelocityRecord(TimesFrom(0.05, 60), 1.1, 0.01)),
              Contains(AllOf(HasSubstr("x is measured, but the data have no sample of it"),
                             HasSubstr("after t = 5 s, the largest delay"))));
}

TEST(SuspiciousData, AreSamplesInAnotherUnit) {
  const Problem problem = TextProblem("a + b*t/10",
                                      {UncertainParameter::Normal("a", 1, 0.3).value(),
                                       UncertainParameter::Normal("b", 0, 0.3).value()},
                                      0.05);
  const std::vector<double> metres = {1.13, 1.18, 1.24, 1.31, 1.33, 1.44, 1.43, 1.52};
  std::vector<double> millimetres = metres;
  for (double& value : millimetres) value *= 1'000;
  EXPECT_THAT(Warnings(Processed(problem, metres)->CurrentEstimate().value()), IsEmpty());
  EXPECT_THAT(Warnings(Processed(problem, millimetres)->CurrentEstimate().value()),
              Contains(AllOf(HasSubstr("what the prior predicts"), HasSubstr("unit of y"))));
}

// Data that contradict the prior by five of its standard deviations are not in another unit.
TEST(SuspiciousData, AreNotThoseThatContradictThePriorALittle) {
  const Problem problem =
      TextProblem("a + 0*t", {UncertainParameter::Normal("a", 0, 1).value()}, 1);
  const auto estimator = Processed(problem, {5.3, 4.1, 6.0, 4.7, 5.2, 3.9, 5.5, 6.4, 4.6, 5.1});
  EXPECT_THAT(Warnings(estimator->CurrentEstimate().value()), IsEmpty());
}

TEST(SuspiciousData, AreSensorsThatNeverChange) {
  const Problem problem =
      TextProblem("a + 0*t", {UncertainParameter::Normal("a", 0, 1).value()}, 1);
  EXPECT_THAT(Warnings(Processed(problem, {2, 2, 2, 2})->CurrentEstimate().value()),
              ElementsAre(HasSubstr("y never changes: it is 2 in every row")));
}

// Makes the problem of y as an expression of the parameters a and b and of t.
Problem SignalProblem(const std::string& output, double noise) {
  return TextProblem(output,
                     {UncertainParameter::Normal("a", 1, 0.2).value(),
                      UncertainParameter::Normal("b", 0, 0.2).value()},
                     noise);
}

// Returns 600 samples of signal(t) with normal noise at 0.02, 0.04, … s, rounded to `step`.
Samples RoundedRecord(const std::function<double(double)>& signal, double noise, double step) {
  std::mt19937_64 generator(4);
  std::normal_distribution<double> normal(0, noise);
  Samples samples;
  samples.columns = {{"y", {}, {}}};
  for (int k = 1; k <= 600; ++k) {
    const double t = 0.02 * k;
    samples.time_s.push_back(t);
    samples.columns[0].value.push_back(std::round((signal(t) + normal(generator)) / step) * step);
  }
  return samples;
}

// At rest, then slow to rise. Residuals of a rest within one step are small, but not because the
// noise stated is too large.
TEST(SuspiciousData, AreStepsBesideWhichTheNoiseIsSmall) {
  const auto signal = [](double t) { return t < 6 ? 0 : 0.86 * (1 - std::exp(6 - t)); };
  const std::string output = "b + a*if(t < 6, 0, 1 - exp(6 - t))";
  const auto message = AllOf(HasSubstr("steps of 0.1, beside which their noise of about 0.0"),
                             HasSubstr("the uncertainty may be far too small"));
  const auto stated = [](double noise, double step) {
    return std::hypot(noise, step / std::sqrt(12));
  };
  const Samples coarse = RoundedRecord(signal, 0.01, 0.1);
  Problem problem = SignalProblem(output, stated(0.01, 0.1));
  const Estimate estimate = EstimateOf(problem, coarse);
  EXPECT_THAT(Warnings(estimate), ElementsAre(message));
  EXPECT_THAT(Message(estimate, DiagnosticCode::kModelMisfit), Not(HasSubstr("too large")));
  problem.measured[0].noise = {.unknown = true};
  EXPECT_THAT(WarningsOf(problem, coarse), ElementsAre(message));
  // Twice the noise.
  EXPECT_THAT(
      WarningsOf(SignalProblem(output, stated(0.05, 0.1)), RoundedRecord(signal, 0.05, 0.1)),
      IsEmpty());
}

TEST(SuspiciousData, AreJumpsThatTheModelDoesNotExplain) {
  const auto signal = [](double t) {
    return std::fmod(t + 0.51, 1) < 0.1 ? 0 : 0.9 + 0.3 * std::sin(t);
  };
  const Samples record = RoundedRecord(signal, 0, 1e-3);
  for (const bool unknown : {false, true}) {
    Problem right = SignalProblem("if(mod(t + 0.51, 1) < 0.1, 0, a + b*sin(t))", 0.006);
    right.measured[0].noise.unknown = unknown;
    EXPECT_THAT(WarningsOf(right, record), IsEmpty()) << unknown;
    Problem wrong = SignalProblem("a + b*sin(t)", 0.006);
    wrong.measured[0].noise.unknown = unknown;
    EXPECT_THAT(WarningsOf(wrong, record), Contains(HasSubstr("as when a signal drops out")))
        << unknown;
  }
}

TEST(SuspiciousData, AreFlatTopsThatTheModelDoesNotExplain) {
  const auto clipped = [](double t) { return std::min(1.1 * std::sin(3 * t), 0.8); };
  const Samples record = RoundedRecord(clipped, 0, 1e-4);
  const Problem right = SignalProblem("b + min(a*sin(3*t), 0.8)", 0.01);
  EXPECT_THAT(WarningsOf(right, record), IsEmpty());
  for (const bool unknown : {false, true}) {
    Problem wrong = SignalProblem("b + a*sin(3*t)", 0.01);
    wrong.measured[0].noise.unknown = unknown;
    EXPECT_THAT(WarningsOf(wrong, record), Contains(HasSubstr("it stops at 0.8"))) << unknown;
  }
}

TEST(SuspiciousData, AreTheSameHoweverTheRowsArrive) {
  const Samples all = CutOutRecord(80);
  const std::vector<std::string> expected = WarningsOf(VelocityProblem(), all);
  for (const size_t batch : {1, 7}) {
    const auto estimator = MakeEstimator(VelocityProblem());
    for (size_t first = 0; first < all.rows(); first += batch) {
      Samples part;
      part.columns = {{"x", {}, {}}};
      for (size_t k = first; k < std::min(first + batch, all.rows()); ++k) {
        part.time_s.push_back(all.time_s[k]);
        part.columns[0].value.push_back(all.columns[0].value[k]);
      }
      ASSERT_TRUE(estimator->Append(part).ok());
      ASSERT_TRUE(estimator->Process().ok());
    }
    EXPECT_EQ(Warnings(estimator->CurrentEstimate().value()), expected);
  }
}

TEST(SuspiciousData, AreRememberedBySnapshots) {
  Problem problem = VelocityProblem();
  problem.integration.samples_between_checkpoints = kInterval;
  Samples samples = InitialVelocityRecord(TimesFrom(0, 2 * kInterval), 1.1, 0.01);
  samples.columns[0].value[0] = 0.4;  // far from the initial state, in the first row only
  Session session(problem);
  session.Take(samples);
  const std::vector<std::string> expected = Warnings(session.Current());
  ASSERT_THAT(expected, ElementsAre(HasSubstr("its first sample, 0.4")));
  const auto restored = MakeEstimator(problem);
  ASSERT_TRUE(restored->Append(samples).ok());
  const absl::Status status = restored->Restore(session.last);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(Warnings(restored->CurrentEstimate().value()), expected);
}

}  // namespace
}  // namespace polyest::internal
