// Score tests of what a problem holds fixed: against linear regression in closed form, and against
// records in which something that is held fixed was another.

#include "core/estimator/studies/score_tests.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <map>
#include <random>

#include "core/estimator/posterior/noise_learning.h"
#include "core/estimator/record/known_inputs_store.h"
#include "core/estimator/record/sample_checks.h"
#include "core/propagation/ensemble_propagator.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using ::testing::StartsWith;

// `scale` is that of the noise with which the record has been weighed (ChannelNoise::scale).
std::vector<ScoreTest> TestsOf(const Problem& problem, const Samples& samples, double scale = 1) {
  const ResolvedProblem resolved = ResolvedProblem::Make(problem).value();
  const std::shared_ptr<SampleStore> store = StoreFor(resolved, nullptr);
  EXPECT_TRUE(store->Append(SampleChecks(resolved).Check(samples).value()).ok());
  std::vector<ChannelNoise> noise = NoiseToBeginWith(problem).channels;
  noise[0].scale = scale;
  return TestFixedQuantities(resolved, *store, store->rows(), noise, EstimateOf(problem, samples),
                             Stop())
      .value()
      .scores;
}

const ScoreTest& Find(const std::vector<ScoreTest>& tests, const std::string& name) {
  const auto test = std::ranges::find(tests, name, &ScoreTest::name);
  EXPECT_NE(test, tests.end()) << name;
  return *test;
}

// With y = a t + b t², a ~ N(2, 1) and b held at 0, the samples z have the mean 2 t + b t² and the
// covariance C = σ² I + t tᵀ. The score of b is gᵀ C⁻¹ (z − 2 t) ÷ √(gᵀ C⁻¹ g) with g = t².
TEST(ScoreTests, AgreeWithRegressionInClosedForm) {
  constexpr double kSigma = 0.1;
  Problem problem =
      TextProblem("a*t + b*t^2", {UncertainParameter::Normal("a", 2, 1).value()}, kSigma);
  problem.fixed = {{"b", 0}};
  constexpr int kRows = 30;
  Samples samples;
  samples.columns = {{"y", {}, {}}};
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal(0, kSigma);
  Vector times(kRows), values(kRows);
  for (int k = 0; k < kRows; ++k) {
    times[k] = 0.1 * (k + 1);
    values[k] = 1.7 * times[k] + 0.05 * times[k] * times[k] + normal(generator);
    samples.time_s.push_back(times[k]);
    samples.columns[0].value.push_back(values[k]);
  }
  const Matrix covariance =
      kSigma * kSigma * Matrix::Identity(kRows, kRows) + times * times.transpose();
  const auto factor = covariance.llt();
  const Vector g = times.cwiseAbs2();
  const double v = g.dot(factor.solve(g));
  const double slope = g.dot(factor.solve(values - 2 * times));
  const std::vector<ScoreTest> tests = TestsOf(problem, samples);
  const ScoreTest& test = Find(tests, "b");
  EXPECT_NEAR(test.score, slope / std::sqrt(v), 1e-6);
  EXPECT_NEAR(test.change, slope / v, 1e-7);
  EXPECT_NEAR(test.deviation, 1 / std::sqrt(v), 1e-7);
  // The posterior of a given b has the variance 1 ÷ (1 + tᵀt/σ²) and moves by −tᵀg/σ² of it per b.
  const double variance = 1 / (1 + times.squaredNorm() / (kSigma * kSigma));
  const double shift = -variance * times.dot(g) / (kSigma * kSigma) * slope / v;
  EXPECT_NEAR(test.shifts[0], shift / std::sqrt(variance), 1e-6);
}

// An oscillator that a swept force drives from a known displacement.
Problem DrivenOscillator() {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.fixed = {{"m", 1}, {"x0", 0.05}, {"v0", 0}};
  problem.uncertain = {UncertainParameter::Uniform("k", 30, 50).value(),
                       UncertainParameter::Uniform("c", 0.2, 1).value()};
  problem.inputs = {{"force", ChirpInput{.amplitude = 1, .end_frequency_hz = 2, .duration_s = 20}}};
  problem.measured = {{"x", {.absolute = 0.002}}};
  return problem;
}

// Returns what the problem's model does with k = 40 N/m and c = 0.5 N s/m, with so many times its
// noise.
Samples RecordOf(const Problem& problem, uint64_t seed, double noise = 1) {
  constexpr int kRows = 400;
  const ResolvedProblem resolved = ResolvedProblem::Make(problem).value();
  Samples samples;
  samples.columns = {{"x", {}, {}}};
  for (int k = 1; k <= kRows; ++k) samples.time_s.push_back(0.05 * k);
  const InputSignals inputs = resolved.MakeInputs();
  EnsemblePropagator propagator(
      resolved.MakeEnsemble(Eigen::RowVector2d(40, 0.5), resolved.outputs(), 1), &inputs);
  Matrix outputs(1, kRows);
  EXPECT_TRUE(propagator.Advance(samples.time_s, outputs, Stop()).ok());
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal(0, problem.measured[0].noise.absolute);
  for (int k = 0; k < kRows; ++k) {
    samples.columns[0].value.push_back(outputs(0, k) + noise * normal(generator));
  }
  return samples;
}

Estimate Tested(const Problem& problem, const Samples& samples) {
  const auto estimator = MakeEstimator(problem);
  EXPECT_TRUE(estimator->Append(samples).ok());
  EXPECT_TRUE(estimator->Process().ok());
  return estimator->TestedEstimate().value();
}

struct WrongValue {
  const char* name;
  double truth;
};

class WrongValues : public testing::TestWithParam<WrongValue> {};

TEST_P(WrongValues, AreNamedWithTheRightOnes) {
  const auto& [name, truth] = GetParam();
  const Problem problem = DrivenOscillator();
  Problem real = problem;
  real.fixed[name] = truth;
  const Samples samples = RecordOf(real, 3);
  const std::vector<ScoreTest> tests = TestsOf(problem, samples);
  const ScoreTest& test = Find(tests, name);
  // The response is not quite linear in the quantities, least of all in a delay.
  EXPECT_NEAR(test.value + test.change, truth,
              4 * test.deviation + 0.05 * std::abs(truth - test.value));
  for (const ScoreTest& other : tests) {
    EXPECT_LE(std::abs(other.score), std::abs(test.score) + 1e-6) << other.name;
  }
  const Estimate estimate = Tested(problem, samples);
  EXPECT_EQ(estimate.diagnostics.front().code, DiagnosticCode::kFixedValueConflict);
  EXPECT_THAT(estimate.diagnostics.front().message,
              StartsWith(absl::StrCat("the residuals ask for ", name, " = ")));
}

INSTANTIATE_TEST_SUITE_P(Quantities, WrongValues,
                         testing::Values(WrongValue{"x.gain", 1.06}, WrongValue{"x.offset", 0.002},
                                         WrongValue{"x.delay", 0.01},
                                         WrongValue{"force.delay", 0.02},
                                         WrongValue{"force.offset", 0.1}, WrongValue{"x0", 0.06},
                                         WrongValue{"v0", 0.05}));

// Of a right model, each score is a standard normal variable: the mean of 60 squares has the
// standard deviation √(2/60).
TEST(ScoreTests, AreStandardNormalWhereAllIsRight) {
  constexpr int kRecords = 60;
  const Problem problem = DrivenOscillator();
  std::map<std::string, double> squares;
  for (int seed = 0; seed < kRecords; ++seed) {
    const Samples samples = RecordOf(problem, static_cast<uint64_t>(seed));
    for (const ScoreTest& test : TestsOf(problem, samples)) {
      squares[test.name] += test.score * test.score / kRecords;
    }
    EXPECT_FALSE(Has(Tested(problem, samples), DiagnosticCode::kFixedValueConflict)) << seed;
  }
  EXPECT_EQ(squares.size(), 9u);  // of x: gain, delay, offset; of the force, too; m, x0, v0
  for (const auto& [name, mean] : squares) {
    EXPECT_NEAR(mean, 1, 4 * std::sqrt(2.0 / kRecords)) << name;
  }
}

// The size of unknown noise with which the record has been weighed does not matter.
TEST(ScoreTests, TakeNoiseOfUnknownSizeFromTheResiduals) {
  Problem problem = DrivenOscillator();
  const Samples samples = RecordOf(problem, 5);
  problem.measured[0].noise = {.unknown = true};
  const std::vector<ScoreTest> right = TestsOf(problem, samples, 0.002);
  ASSERT_THAT(right, SizeIs(9));
  // 400 residuals tell the size of their noise within 3.5 %.
  const std::vector<ScoreTest> known = TestsOf(DrivenOscillator(), samples);
  EXPECT_NEAR(Find(right, "x.delay").deviation, Find(known, "x.delay").deviation,
              0.1 * Find(known, "x.delay").deviation);
  for (const double factor : {0.8, 1.2}) {
    const std::vector<ScoreTest> tests = TestsOf(problem, samples, 0.002 * factor);
    ASSERT_THAT(tests, SizeIs(right.size())) << factor;
    for (const ScoreTest& test : right) {
      EXPECT_NEAR(Find(tests, test.name).score, test.score, 1e-3) << test.name << factor;
    }
  }
}

// Of the estimate itself, only the verdicts change.
TEST(ScoreTests, LetParametersThatAWrongValueMovesBeWeakAtMost) {
  Problem real = DrivenOscillator();
  real.fixed["x.gain"] = 1.02;
  const Samples samples = RecordOf(real, 3);
  const Vector shifts = TestsOf(DrivenOscillator(), samples).front().shifts;
  Estimate expected = EstimateOf(DrivenOscillator(), samples);
  int changed = 0;
  for (size_t i = 0; i < 2; ++i) {
    ParameterEstimate& parameter = expected.parameters[i];
    if (std::abs(shifts[static_cast<Eigen::Index>(i)]) < 1) continue;
    EXPECT_EQ(parameter.verdict, Verdict::kIdentified);
    parameter.verdict = Verdict::kWeak;
    ++changed;
  }
  EXPECT_GT(changed, 0);
  EXPECT_EQ(NumbersOf(Tested(DrivenOscillator(), samples)), NumbersOf(expected));
}

// Correlated noise is whitened, and gives the scores no larger variance.
TEST(ScoreTests, AreStandardNormalWhereNoiseIsCorrelated) {
  constexpr int kRecords = 40;
  Problem problem = DrivenOscillator();
  problem.measured[0].noise.correlation = NoiseCorrelation::kKnown;
  problem.measured[0].noise.time_constant_s = 0.2;
  double squares = 0;
  int count = 0;
  for (int seed = 0; seed < kRecords; ++seed) {
    Samples samples = RecordOf(DrivenOscillator(), static_cast<uint64_t>(seed));
    const Samples exact = RecordOf(DrivenOscillator(), static_cast<uint64_t>(seed), 0);
    // The samples' white noise w becomes n_k = a n_(k−1) + √(1 − a²) w_k.
    const double a = std::exp(-0.05 / 0.2);
    double noise = 0;
    for (size_t k = 0; k < samples.rows(); ++k) {
      const double white = samples.columns[0].value[k] - exact.columns[0].value[k];
      noise = k == 0 ? white : a * noise + std::sqrt(1 - a * a) * white;
      samples.columns[0].value[k] = exact.columns[0].value[k] + noise;
    }
    for (const ScoreTest& test : TestsOf(problem, samples)) {
      squares += test.score * test.score;
      ++count;
    }
  }
  // The nine scores of a record are correlated: they count as three.
  EXPECT_NEAR(squares / count, 1, 4 * std::sqrt(2.0 / (3 * kRecords)));
}

TEST(ScoreTests, AreNotMadeOfFiltersNorOfRunsWithOwnParameters) {
  Problem filtered = DrivenOscillator();
  filtered.process_noise = {{.state = "v", .spectral_density = 0.01}};
  const Samples samples = RecordOf(DrivenOscillator(), 3);
  EXPECT_THAT(TestsOf(filtered, samples), IsEmpty());
  Problem of_runs = DrivenOscillator();
  of_runs.uncertain[1].per_run = true;
  EXPECT_THAT(TestsOf(of_runs, samples), IsEmpty());
}

}  // namespace
}  // namespace polyest::internal
