// Tests the time constant of correlated noise for sampling that has no interval of its own: bursts,
// few samples, many short runs. The model is a straight line, whose estimate for a known covariance
// is generalized least squares.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::time_constant_test {
namespace {

using ::testing::HasSubstr;

constexpr double kNoiseOfLine = 0.1;

// Makes the problem y = a + b t/T.
Problem LineProblem(double duration_s, const NoiseModel& noise) {
  Problem problem = TextProblem("a + b*t/duration",
                                {UncertainParameter::Uniform("a", -10, 10).value(),
                                 UncertainParameter::Uniform("b", -10, 10).value()},
                                1);
  problem.fixed["duration"] = duration_s;
  problem.measured[0].noise = noise;
  return problem;
}

// Returns 1 + ½ t/T with correlated noise; every change in `run` begins anew.
Samples Line(const std::vector<double>& time_s, const std::vector<int>& run, double duration_s,
             double time_constant_s, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  Samples samples;
  samples.time_s = time_s;
  samples.run = run;
  samples.columns = {{"y", {}, {}}};
  double e = 0;
  for (size_t k = 0; k < time_s.size(); ++k) {
    const bool first = k == 0 || (!run.empty() && run[k] != run[k - 1]);
    const double a =
        first || time_constant_s == 0 ? 0 : std::exp((time_s[k - 1] - time_s[k]) / time_constant_s);
    e = a * e + std::sqrt(1 - a * a) * normal(random);
    samples.columns[0].value.push_back(1 + 0.5 * time_s[k] / duration_s + kNoiseOfLine * e);
  }
  return samples;
}

struct Fit {
  Vector value;      // a, b
  Vector deviation;  // their standard deviations
};

// Returns generalized least squares for the true covariance of one run.
Fit GeneralizedLeastSquares(const Samples& line, double duration_s, double time_constant_s) {
  const auto rows = static_cast<Eigen::Index>(line.rows());
  Matrix x(rows, 2), covariance(rows, rows);
  Vector z(rows);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double t = line.time_s[static_cast<size_t>(i)];
    x.row(i) << 1, t / duration_s;
    z[i] = line.columns[0].value[static_cast<size_t>(i)];
    for (Eigen::Index j = 0; j < rows; ++j) {
      const double lag = std::abs(t - line.time_s[static_cast<size_t>(j)]);
      covariance(i, j) = kNoiseOfLine * kNoiseOfLine * std::exp(-lag / time_constant_s);
    }
  }
  const Eigen::LLT<Matrix> factor(covariance);
  const Matrix information = x.transpose() * factor.solve(x);
  const Eigen::LLT<Matrix> inverse(information);
  return {inverse.solve(x.transpose() * factor.solve(z)),
          inverse.solve(Matrix::Identity(2, 2)).diagonal().cwiseSqrt()};
}

// Bursts of ten samples, 1 ms apart, every 10 s: at the mean interval of 1 s, noise of 2 ms has no
// correlation at all.
TEST(TimeConstant, IsThatOfTheIntervalsInsideBursts) {
  std::vector<double> times;
  for (int burst = 1; burst <= 40; ++burst) {
    for (int k = 0; k < 10; ++k) times.push_back(10 * burst + 1e-3 * k);
  }
  const Samples line = Line(times, {}, 400, 0.002, 3);
  const Estimate estimate = EstimateOf(
      LineProblem(400, {.unknown = true, .correlation = NoiseCorrelation::kUnknown}), line);
  // Per pair of samples a = e^−½ is known to √(1 − a²), so log τ to √((1 − a²)/360)/(½ a) = 0.14.
  EXPECT_NEAR(std::log(estimate.channels[0].noise_time_constant_s / 0.002), 0, 3 * 0.14);
  const Fit oracle = GeneralizedLeastSquares(line, 400, 0.002);
  for (Eigen::Index i = 0; i < 2; ++i) {
    const ParameterEstimate& p = estimate.parameters[static_cast<size_t>(i)];
    // The power of the noise is proportional to about τ, whose error of 0.14 makes one of 0.07 of
    // the standard deviation; that of the size of 400 samples, of which about 100 are independent,
    // is as large.
    EXPECT_NEAR(p.std_dev / oracle.deviation[i], 1, 3 * 0.1) << p.name;
    EXPECT_NEAR(p.mean, oracle.value[i], 0.25 * oracle.deviation[i]) << p.name;
  }
  // A burst tells as much as 1 + 9 (1 − a)/(1 + a) = 3.2 independent samples.
  EXPECT_NEAR(estimate.channels[0].effective_samples, 40 * 3.2, 40);
}

TEST(TimeConstant, IsLearnedFromAFewSamples) {
  std::vector<double> times;
  for (int k = 1; k <= 17; ++k) times.push_back(k);
  const NoiseModel noise{.absolute = kNoiseOfLine, .correlation = NoiseCorrelation::kUnknown};
  int learned = 0;
  for (uint64_t seed = 1; seed <= 4; ++seed) {
    const Samples line = Line(times, {}, 17, 10, seed);
    const Estimate estimate = EstimateOf(LineProblem(17, noise), line);
    if (estimate.channels[0].noise_time_constant_s > 0) ++learned;
    const Fit oracle = GeneralizedLeastSquares(line, 17, 10);
    const Fit white = GeneralizedLeastSquares(line, 17, 1e-3);
    EXPECT_GT(estimate.parameters[0].std_dev, 1.3 * white.deviation[0]);
    EXPECT_NEAR(estimate.parameters[0].mean, oracle.value[0], 2 * oracle.deviation[0]);
  }
  EXPECT_GE(learned, 3);
}

TEST(TimeConstant, IsSaidNotToBeLearnedFromFewerSamples) {
  const NoiseModel noise{.absolute = kNoiseOfLine, .correlation = NoiseCorrelation::kUnknown};
  const Estimate estimate =
      EstimateOf(LineProblem(7, noise), Line({1, 2, 3, 4, 5, 6, 7}, {}, 7, 10, 1));
  EXPECT_THAT(Message(estimate, DiagnosticCode::kNoiseNotLearned),
              HasSubstr("too few samples (7), fewer than 8, to learn its noise from; it is taken "
                        "to be white"));
}

// A random walk has no time constant. With a straight line taken out, the most probable one is more
// than a fifth of the record for six walks of ten.
TEST(TimeConstant, IsSaidToBeALargePartOfTheRecord) {
  std::vector<double> times;
  for (int k = 1; k <= 200; ++k) times.push_back(0.1 * k);
  int said = 0;
  for (uint64_t seed = 1; seed <= 6; ++seed) {
    const Estimate estimate =
        EstimateOf(LineProblem(20, {.unknown = true, .correlation = NoiseCorrelation::kUnknown}),
                   Line(times, {}, 20, 1e4, seed));
    const std::string message = Message(estimate, DiagnosticCode::kNoiseNotLearned);
    if (message.find("a large part of the record of 19.9 s") != std::string::npos) ++said;
    EXPECT_GT(estimate.channels[0].noise_time_constant_s, 0.4);
  }
  EXPECT_GE(said, 2);
}

// Neither the beginnings of runs nor their ends correlate anything.
TEST(Lag1Correlation, OfWhiteNoiseIsNoneInManyShortRuns) {
  std::vector<double> times;
  std::vector<int> runs;
  for (int run = 0; run < 400; ++run) {
    for (int k = 1; k <= 3; ++k) {
      times.push_back(k);
      runs.push_back(run);
    }
  }
  const Estimate estimate =
      EstimateOf(LineProblem(3, {.absolute = kNoiseOfLine}), Line(times, runs, 3, 0, 7));
  // Of 800 products of two among 1200 samples, the sum is known to √800.
  EXPECT_NEAR(estimate.channels[0].lag1_correlation, 0, 3 * std::sqrt(800) / 1200);
  EXPECT_FALSE(Has(estimate, DiagnosticCode::kCorrelatedResiduals));
}

// A constant a with the noise r a: the maximum of the likelihood solves r² a² + a m₁ = m₂, with the
// first two moments of the samples, and its standard deviation is r a/√(N (1 + 2 r²)).
TEST(RelativeNoise, IsThatOfThePredictionAndNotOfTheSample) {
  const double r = 0.2;
  const Problem problem = [&] {
    Problem p = TextProblem("a", {UncertainParameter::Uniform("a", 0.5, 1.5).value()}, 1);
    p.measured[0].noise = {.relative = r};
    return p;
  }();
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal;
  std::vector<double> z;
  double first = 0, second = 0;
  for (int k = 0; k < 400; ++k) {
    z.push_back(1 + r * normal(random));
    first += z.back() / 400;
    second += z.back() * z.back() / 400;
  }
  const Estimate estimate = Processed(problem, z)->CurrentEstimate().value();
  const double exact = (-first + std::sqrt(first * first + 4 * r * r * second)) / (2 * r * r);
  const double deviation = r * exact / std::sqrt(400 * (1 + 2 * r * r));
  EXPECT_NEAR(estimate.parameters[0].map, exact, 0.1 * deviation);
  EXPECT_NEAR(estimate.parameters[0].std_dev, deviation, 0.05 * deviation);
  EXPECT_TRUE(estimate.diagnostics.empty());
}

TEST(RelativeNoise, IsSaidToBeBiasedWhereItIsThatOfTheSample) {
  Problem problem = TextProblem("a", {UncertainParameter::Uniform("a", 0.5, 1.5).value()}, 1);
  problem.measured[0].noise = {.relative = 0.2};
  problem.expansion.adaptive = false;
  const Estimate estimate = Processed(problem, {1, 1.1, 0.9, 1.2})->CurrentEstimate().value();
  EXPECT_THAT(Message(estimate, DiagnosticCode::kNoiseNotLearned),
              HasSubstr("relative noise of 20 % is taken of the samples"));
}

}  // namespace
}  // namespace polyest::internal::time_constant_test
