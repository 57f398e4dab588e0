// Tests what an estimate says where windows of the record contradict it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::windows_test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kNoise = 0.1;
constexpr int kRows = 4000;

// y = g sin(2πt/10) with g(t) = 1 + drift (t/T − ½), sampled every second, with noise that is
// correlated by `correlation` from row to row.
std::vector<double> Gain(double drift, double correlation, uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal(0, kNoise);
  std::vector<double> values;
  double noise = normal(generator);
  for (int k = 1; k <= kRows; ++k) {
    const double gain = 1 + drift * (static_cast<double>(k) / kRows - 0.5);
    values.push_back(gain * std::sin(2 * std::numbers::pi * k / 10) + noise);
    noise = correlation * noise + std::sqrt(1 - correlation * correlation) * normal(generator);
  }
  return values;
}

Estimate EstimateOfGain(const std::vector<double>& values, double noise = kNoise) {
  const Problem problem =
      TextProblem("g*sin(2*pi*t/10)", {UncertainParameter::Uniform("g", 0, 2).value()}, noise);
  return Processed(problem, values)->CurrentEstimate().value();
}

// The standard deviation by the noise assumed: σ/√(Σ sin²) = σ/√(N/2).
const double kByNoise = kNoise / std::sqrt(kRows / 2.0);

TEST(Windows, SayNothingOfARightModel) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const Estimate estimate = EstimateOfGain(Gain(0, 0, seed));
    EXPECT_THAT(estimate.diagnostics, IsEmpty()) << seed;
    EXPECT_THAT(estimate.windows, IsEmpty());
    EXPECT_GT(estimate.disagreement, 0.4);
    EXPECT_LT(estimate.disagreement, 2);
    EXPECT_NEAR(estimate.parameters[0].std_dev, kByNoise, 1e-3 * kByNoise);
    EXPECT_NEAR(estimate.parameters[0].robust_std_dev, estimate.disagreement * kByNoise,
                0.01 * kByNoise);
    EXPECT_EQ(estimate.parameters[0].verdict, Verdict::kIdentified);
  }
}

// χ²/N is 1 + ½ drift²/12/σ² = 1.04 and the lag-1 correlation 0.03: neither tells.
TEST(Windows, NameAParameterThatDrifts) {
  constexpr double kDrift = 0.1;
  const Estimate estimate = EstimateOfGain(Gain(kDrift, 0, 7));
  EXPECT_FALSE(Has(estimate, DiagnosticCode::kModelMisfit));
  EXPECT_FALSE(Has(estimate, DiagnosticCode::kCorrelatedResiduals));
  EXPECT_THAT(Message(estimate, DiagnosticCode::kInconsistentOverTime),
              HasSubstr("g is not constant over the record: 0.9"));
  EXPECT_THAT(Message(estimate, DiagnosticCode::kInconsistentOverTime),
              HasSubstr("; if g changes with time, let it drift"));
  EXPECT_TRUE(Has(estimate, DiagnosticCode::kWindowsDisagree));
  EXPECT_EQ(estimate.parameters[0].verdict, Verdict::kWeak);
  // The windows follow the drift, each within five of its deviations.
  ASSERT_GE(estimate.windows.size(), 8);
  for (const WindowEstimate& window : estimate.windows) {
    ASSERT_EQ(window.parameters.size(), 1);
    const WindowParameter& g = window.parameters[0];
    const double middle = (window.start_s + window.end_s) / 2;
    EXPECT_NEAR(g.value, 1 + kDrift * (middle / kRows - 0.5), 5 * g.std_dev);
    EXPECT_LT(g.std_dev, 0.02);
  }
  EXPECT_EQ(estimate.windows.front().start_s, 1);
  EXPECT_EQ(estimate.windows.back().end_s, kRows);
  // With at least 12 windows of information I/12 each, the variance of the estimate is that of a
  // mean of 12 values spread uniformly over the drift: drift/√12/√12 and more.
  EXPECT_GT(estimate.parameters[0].std_dev, 0.8 * kDrift / 12);
  EXPECT_EQ(estimate.parameters[0].std_dev, estimate.parameters[0].robust_std_dev);
  const double half = (estimate.parameters[0].upper95 - estimate.parameters[0].lower95) / 2;
  EXPECT_NEAR(half, 1.96 * estimate.parameters[0].std_dev, 0.05 * half);
}

TEST(Windows, StayWithinTheBoundsOfThePrior) {
  const Problem problem =
      TextProblem("g*sin(2*pi*t/10)", {UncertainParameter::Uniform("g", 0, 1.02).value()}, kNoise);
  const Estimate estimate = Processed(problem, Gain(0.2, 0, 7))->CurrentEstimate().value();
  ASSERT_GE(estimate.windows.size(), 8);
  const WindowParameter& last = estimate.windows.back().parameters.at(0);
  EXPECT_DOUBLE_EQ(last.value, 1.02);
  // A window of at most a ninth of the rows: σ/√(N/2/9), and less than twice as many.
  EXPECT_GT(last.std_dev, 2 * kByNoise);
  EXPECT_LT(last.std_dev, 5 * kByNoise);
}

// The truth is b = 0, on the bound, and the data often ask for less: y = d + b t/2000, with d
// larger by `step` in the second half.
TEST(Windows, SayNothingOfAParameterBesideAnotherOnItsBound) {
  const Problem problem = TextProblem("d + b*t/2000",
                                      {UncertainParameter::Normal("d", 0, 1).value(),
                                       UncertainParameter::Uniform("b", 0, 1).value()},
                                      kNoise);
  const auto estimate = [&](int rows, double step, uint64_t seed) {
    std::mt19937_64 generator(seed);
    std::normal_distribution<double> normal(0.3, kNoise);
    std::vector<double> values;
    for (int k = 0; k < rows; ++k) values.push_back(normal(generator) + (k < rows / 2 ? 0 : step));
    return Processed(problem, values)->CurrentEstimate().value();
  };
  int on_bound = 0;
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const Estimate constant = estimate(300, 0, seed);
    EXPECT_FALSE(Has(constant, DiagnosticCode::kInconsistentOverTime)) << seed;
    if (Has(constant, DiagnosticCode::kAtPriorBound)) ++on_bound;
  }
  EXPECT_GE(on_bound, 5);  // half of them, give or take two standard deviations
  // A trend, which may have b < 0 in this test, leaves a quarter of the fall's sum of squares, 0.14
  // σ² a row or 2,250 σ². The dispersion is about 10.
  EXPECT_TRUE(Has(estimate(16'000, -0.15, 1), DiagnosticCode::kInconsistentOverTime));
}

// Correlated noise of the right size: the spectrum at the signal's frequency replaces σ².
TEST(Windows, WidenWhatCorrelatedResidualsMakeTooNarrow) {
  constexpr double kA = 0.9;
  const double omega = 2 * std::numbers::pi / 10;
  const double spectrum = (1 - kA * kA) / (1 - 2 * kA * std::cos(omega) + kA * kA);
  ASSERT_LT(spectrum, 1);  // fast signal: slow noise hurts it less than white noise does
  const Estimate fast = EstimateOfGain(Gain(0, kA, 3));
  EXPECT_TRUE(Has(fast, DiagnosticCode::kCorrelatedResiduals));
  EXPECT_LT(fast.parameters[0].std_dev, 1.3 * kByNoise);

  const Problem problem =
      TextProblem("g", {UncertainParameter::Uniform("g", -2, 2).value()}, kNoise);
  double variance = 0;
  constexpr int kSeeds = 20;
  for (uint64_t seed = 1; seed <= kSeeds; ++seed) {
    std::vector<double> values = Gain(0, kA, seed);
    for (int k = 1; k <= kRows; ++k) values[static_cast<size_t>(k - 1)] -= std::sin(omega * k);
    const Estimate slow = Processed(problem, values)->CurrentEstimate().value();
    EXPECT_TRUE(Has(slow, DiagnosticCode::kCorrelatedResiduals));
    EXPECT_THAT(Message(slow, DiagnosticCode::kCorrelatedResiduals), HasSubstr("widened"));
    variance += slow.parameters[0].std_dev * slow.parameters[0].std_dev / kSeeds;
  }
  // Var = (1 + a)/(1 − a) σ²/N; windows of 62 rows or more miss less than 2a/(1 − a²)/62 < 16 % of
  // it.
  EXPECT_NEAR(variance / ((1 + kA) / (1 - kA) * kNoise * kNoise / kRows), 1.1, 0.3);
}

TEST(Windows, WidenByAMisfitOfWhiteNoise) {
  const Estimate estimate = EstimateOfGain(Gain(0, 0, 5), kNoise / 3);
  EXPECT_THAT(Message(estimate, DiagnosticCode::kModelMisfit), HasSubstr("widened"));
  EXPECT_FALSE(Has(estimate, DiagnosticCode::kInconsistentOverTime));
  // A standard deviation from 12 windows or more has a standard error of 1/√24.
  EXPECT_NEAR(estimate.parameters[0].std_dev, kByNoise, 2.5 / std::sqrt(24) * kByNoise);
  EXPECT_NEAR(estimate.parameters[0].posterior_std_dev, estimate.parameters[0].std_dev,
              0.05 * kByNoise);
}

// Too few rows for windows: χ² itself widens.
TEST(Windows, WidenByChiSquaredWhereTheyAreTooFew) {
  std::vector<double> values = Gain(0, 0, 5);
  values.resize(11);
  const Estimate narrow = EstimateOfGain(values, kNoise / 10);
  const Estimate right = EstimateOfGain(values, kNoise);
  EXPECT_EQ(narrow.disagreement, 0);
  EXPECT_EQ(narrow.parameters[0].robust_std_dev, 0);
  EXPECT_TRUE(Has(narrow, DiagnosticCode::kModelMisfit));
  const double dispersion = narrow.channels[0].chi_squared / 11;
  EXPECT_GE(narrow.parameters[0].std_dev,
            0.999 * std::sqrt(dispersion) * 0.1 * right.parameters[0].std_dev);
}

// However large the residuals are, nobody knows less than before.
TEST(Windows, NeverWidenBeyondThePrior) {
  const Problem problem =
      TextProblem("g*sin(2*pi*t/10)", {UncertainParameter::Normal("g", 1, 0.02).value()}, 1e-3);
  const Estimate estimate = Processed(problem, Gain(1, 0.5, 2))->CurrentEstimate().value();
  EXPECT_TRUE(Has(estimate, DiagnosticCode::kModelMisfit));
  EXPECT_LE(estimate.parameters[0].std_dev, 0.02);
  EXPECT_LE(estimate.parameters[0].robust_std_dev, 0.02);
  EXPECT_LE(estimate.parameters[0].posterior_std_dev, 0.0201);
}

// 20,000 rows whose noise is 10 % larger than assumed were no misfit for a threshold of 1.5 N.
TEST(Windows, ThresholdsGrowSharpWithTheNumberOfSamples) {
  std::vector<double> values = Gain(0, 0, 9);
  EXPECT_TRUE(Has(EstimateOfGain(values, kNoise / 1.15), DiagnosticCode::kModelMisfit));
  EXPECT_FALSE(Has(EstimateOfGain(values, kNoise / 1.05), DiagnosticCode::kModelMisfit));
  EXPECT_TRUE(Has(EstimateOfGain(Gain(0, 0.1, 9)), DiagnosticCode::kCorrelatedResiduals));
  values.resize(100);
  EXPECT_FALSE(Has(EstimateOfGain(values, kNoise / 1.15), DiagnosticCode::kModelMisfit));
}

}  // namespace
}  // namespace polyest::internal::windows_test
