// Records whose quantities are sampled at times of their own.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "core/estimator/problem/resolved_problem.h"
#include "core/propagation/ensemble_propagator.h"
#include "tests/testing/records.h"
#include "tests/unit/core/estimator/estimation.h"

namespace polyest::internal {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using testing::EstimateInBatches;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kSigma = 0.01;

// m ẍ + c ẋ + k x = force with k unknown.
Problem StiffnessProblem(Interpolation interpolation) {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.fixed = {{"m", 1}, {"c", 0.5}, {"x0", 0}, {"v0", 0}};
  problem.uncertain = {UncertainParameter::Uniform("k", 8, 12).value()};
  problem.inputs = {{"force", StreamedInput{.interpolation = interpolation}}};
  problem.measured = {{"x", {.absolute = kSigma}}};
  problem.expansion.order = 3;
  return problem;
}

using Series = std::map<double, double>;  // values by time

// Makes a record of one run, in which each quantity has its own times.
Samples Interleaved(const Series& x, const Series& force) {
  std::map<double, int> times;
  for (const auto& [t, value] : x) times[t];
  for (const auto& [t, value] : force) times[t];
  Samples samples;
  samples.columns = {{"x", {}, {}}, {"force", {}, {}}};
  const auto add = [](const Series& series, double t, SampleColumn& column) {
    const auto found = series.find(t);
    column.missing.push_back(found == series.end());
    column.value.push_back(found == series.end() ? std::nan("") : found->second);
  };
  for (const auto& [t, unused] : times) {
    samples.time_s.push_back(t);
    add(x, t, samples.columns[0]);
    add(force, t, samples.columns[1]);
  }
  samples.end_of_run = true;
  return samples;
}

double Ramp(double t) { return 2 * t - 1; }
double Parabola(double t) { return t * (t - 3); }
double Wave(double t) { return 3 * std::sin(2 * t); }

// Returns samples of the model with k = 10 and an error that looks like noise.
Series Displacements(int count, double (*force)(double) = Wave) {
  Problem problem = StiffnessProblem(Interpolation::kCubic);
  TableInput table{.time_s = {}, .value = {}, .interpolation = Interpolation::kCubic};
  for (int k = 0; k <= 10 * count + 10; ++k) {
    table.time_s.push_back(0.005 * k);
    table.value.push_back(force(0.005 * k));
  }
  problem.inputs = {{"force", table}};
  const ResolvedProblem resolved = ResolvedProblem::Make(problem).value();
  const InputSignals inputs = resolved.MakeInputs();
  EnsemblePropagator model(resolved.MakeEnsemble(Matrix::Constant(1, 1, 10), {0}, 1), &inputs);
  std::vector<double> times;
  for (int k = 1; k <= count; ++k) times.push_back(0.05 * k);
  Matrix outputs(1, count);
  EXPECT_TRUE(model.Advance(times, outputs, {}).ok());
  Series x;
  for (int k = 1; k <= count; ++k) {
    x[times[static_cast<size_t>(k - 1)]] = outputs(0, k - 1) + kSigma * std::sin(k * k);
  }
  return x;
}

Series ForceEvery(double step_s, double until_s, double (*force)(double)) {
  Series series;
  for (int k = 0; (k - 1) * step_s < until_s; ++k) series[k * step_s] = force(k * step_s);
  return series;
}

class AnyCurve : public ::testing::TestWithParam<Interpolation> {};

INSTANTIATE_TEST_SUITE_P(TimeBases, AnyCurve,
                         ::testing::Values(Interpolation::kHold, Interpolation::kLinear,
                                           Interpolation::kCubic, Interpolation::kShapePreserving));

TEST_P(AnyCurve, GivesTheSameBitsForAnyBatches) {
  Samples record = Interleaved(Displacements(80), ForceEvery(0.133, 4, Wave));
  for (SampleColumn& column : record.columns) column.missing[40] = true;  // a row without anything
  const Problem problem = StiffnessProblem(GetParam());
  const Estimate whole = EstimateInBatches(problem, record, 1000);
  EXPECT_GE(whole.samples, 79);
  for (const size_t batch : {1, 3, 50}) {
    ExpectSame(EstimateInBatches(problem, record, batch), whole);
  }
}

// A force that the interpolation follows exactly is the same whichever of its values are knots. The
// model steps exactly from knot to knot, so that only rounding is left; the fixed expansion has no
// windows, which count rows.
TEST(TimeBases, DoNotMatterForAnExactlyInterpolatedInput) {
  for (const Interpolation interpolation : {Interpolation::kLinear, Interpolation::kCubic}) {
    const auto force = interpolation == Interpolation::kLinear ? Ramp : Parabola;
    Problem problem = StiffnessProblem(interpolation);
    const Series x = Displacements(80, force);
    Series in_rows = {{0, force(0)}, {4.2, force(4.2)}};
    for (const auto& [t, value] : x) in_rows[t] = force(t);
    const Samples together = Interleaved(x, in_rows);
    const Samples apart = Interleaved(x, ForceEvery(0.133, 4.1, force));
    ASSERT_GT(apart.rows(), together.rows());
    problem.expansion.adaptive = false;
    const ParameterEstimate a = EstimateInBatches(problem, together, 7).parameters[0];
    const ParameterEstimate b = EstimateInBatches(problem, apart, 7).parameters[0];
    EXPECT_NEAR(a.map, b.map, 1e-12 * a.map);
    EXPECT_NEAR(a.mean, b.mean, 1e-12 * a.mean);
    EXPECT_NEAR(a.std_dev, b.std_dev, 1e-12 * a.mean);
    // Moving expansions follow the model to a tenth of a standard deviation each.
    problem.expansion.adaptive = true;
    const ParameterEstimate c = EstimateInBatches(problem, together, 7).parameters[0];
    const ParameterEstimate d = EstimateInBatches(problem, apart, 7).parameters[0];
    EXPECT_NEAR(c.mean, d.mean, 0.1 * c.std_dev);
  }
}

int64_t ProcessedOf(Interpolation interpolation, Samples record) {
  record.end_of_run = false;
  const auto estimator = MakeEstimator(StiffnessProblem(interpolation));
  EXPECT_TRUE(estimator->Append(record).ok());
  EXPECT_TRUE(estimator->Process().ok());
  const int64_t processed = estimator->rows_processed();
  Samples end;
  end.end_of_run = true;
  EXPECT_TRUE(estimator->Append(end).ok());
  EXPECT_TRUE(estimator->Process().ok());
  EXPECT_EQ(estimator->rows_processed(), estimator->rows_appended());
  return processed;
}

// Rows: x at 0.05, 0.10, …, 0.50, the force at 0.12, 0.22, 0.32, 0.42 (rows 2, 5, 8, 11).
TEST(TimeBases, LetRowsWaitForTheKnotsThatSettleThem) {
  const Samples record =
      Interleaved(Displacements(10), {{0.12, 1}, {0.22, 2}, {0.32, -1}, {0.42, 0}});
  ASSERT_EQ(record.rows(), 14);
  EXPECT_EQ(ProcessedOf(Interpolation::kHold, record), 14);
  EXPECT_EQ(ProcessedOf(Interpolation::kLinear, record), 12);
  EXPECT_EQ(ProcessedOf(Interpolation::kShapePreserving, record), 6);
  EXPECT_EQ(ProcessedOf(Interpolation::kCubic, record), 3);
  for (const Interpolation any : {Interpolation::kHold, Interpolation::kCubic}) {
    EXPECT_EQ(ProcessedOf(any, Interleaved(Displacements(10), {})), 0);
  }
}

std::string WarningOf(Interpolation interpolation, const Samples& record) {
  return Message(EstimateOf(StiffnessProblem(interpolation), record),
                 DiagnosticCode::kSuspiciousData);
}

TEST(TimeBases, JudgeTheGapsOfAnInputByItsOwnKnots) {
  EXPECT_EQ(WarningOf(Interpolation::kLinear,
                      Interleaved(Displacements(80, Ramp), ForceEvery(0.9, 4, Ramp))),
            "");
  Series force = ForceEvery(0.02, 4, Wave);
  force.erase(force.upper_bound(1.01), force.upper_bound(1.3));
  EXPECT_THAT(WarningOf(Interpolation::kLinear, Interleaved(Displacements(80), force)),
              AllOf(HasSubstr("force: 1 gap"), HasSubstr("after t = 1 s")));
}

TEST(TimeBases, WarnOfAnInputThatEndsBeforeItsRun) {
  const Samples record = Interleaved(Displacements(80), ForceEvery(0.02, 1, Wave));
  EXPECT_THAT(WarningOf(Interpolation::kCubic, record),
              AllOf(HasSubstr("force: the streamed input has no sample in the last 3 s"),
                    HasSubstr("after t = 1 s")));
  EXPECT_EQ(WarningOf(Interpolation::kHold, record), "");
}

TEST(TimeBases, WarnOfAnInputThatBeginsAfterItsRun) {
  Series force = ForceEvery(0.02, 4, Wave);
  force.erase(force.begin(), force.upper_bound(0.99));
  for (const Interpolation any : {Interpolation::kHold, Interpolation::kCubic}) {
    const std::string warning = WarningOf(any, Interleaved(Displacements(80), force));
    EXPECT_THAT(warning, HasSubstr("force: the streamed input has no sample in the first 0.9"));
    EXPECT_THAT(warning, HasSubstr("before t = 1 s"));
  }
}

// Without any sample an input is 0.
TEST(TimeBases, WarnOfARunWithoutASampleOfAnInput) {
  Samples without = Interleaved(Displacements(40), {});
  const std::string warning = WarningOf(Interpolation::kCubic, without);
  EXPECT_THAT(warning, HasSubstr("force: the streamed input has no sample in 1 run"));
  without.columns.pop_back();
  EXPECT_EQ(WarningOf(Interpolation::kCubic, without), warning);
  Problem undriven = StiffnessProblem(Interpolation::kCubic);
  undriven.inputs.clear();
  const Estimate a = EstimateOf(StiffnessProblem(Interpolation::kCubic), without);
  const Estimate b = EstimateOf(undriven, without);
  EXPECT_EQ(a.parameters[0].mean, b.parameters[0].mean);
}

}  // namespace
}  // namespace polyest::internal
