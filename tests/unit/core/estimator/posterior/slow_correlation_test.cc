// Tests that errors are noticed which last for many samples, but of which successive residuals show
// next to nothing.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Samples of 1 + 0.5 t/100 with noise of 0.05, of whose variance a share is correlated over 40
// samples.
std::vector<double> Line(double slow_share, uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal(0, 0.05);
  const double a = std::exp(-1.0 / 40);
  double slow = normal(generator);
  std::vector<double> values;
  for (int k = 1; k <= 600; ++k) {
    slow = a * slow + std::sqrt(1 - a * a) * normal(generator);
    values.push_back(1 + 0.005 * k + std::sqrt(slow_share) * slow +
                     std::sqrt(1 - slow_share) * normal(generator));
  }
  return values;
}

Problem LineProblem() {
  Problem problem = TextProblem("a + b*t/100",
                                {UncertainParameter::Normal("a", 0, 3).value(),
                                 UncertainParameter::Normal("b", 0, 3).value()},
                                0.05);
  problem.measured[0].noise = {.unknown = true};
  return problem;
}

std::string CorrelationOf(const Estimate& estimate) {
  for (const Diagnostic& diagnostic : estimate.diagnostics) {
    if (diagnostic.code == DiagnosticCode::kCorrelatedResiduals) return diagnostic.message;
  }
  return "";
}

// The speed of a body that coasts down, v = √(f/g) tan(arctan(v0 √(g/f)) − √(f g) t), at 10 Hz.
Problem CoastDown() {
  return TextProblem("sqrt(f/g)*tan(atan(v*sqrt(g/f)) - sqrt(f*g)*t/10)",
                     {UncertainParameter::Uniform("f", 0.05, 0.2).value(),
                      UncertainParameter::Uniform("g", 1.5e-4, 4.5e-4).value(),
                      UncertainParameter::Normal("v", 33.3, 0.5).value()},
                     0.016);
}

std::vector<double> Speeds(uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal(0, 0.016);
  std::uniform_real_distribution<double> uniform(0.05, 0.95);
  const double f = 0.05 + 0.15 * uniform(generator), g = 1.5e-4 + 3e-4 * uniform(generator);
  const double v = 33.3 + 20 * normal(generator);
  std::vector<double> values;
  for (int k = 1; k <= 600; ++k) {
    const double angle = std::atan(v * std::sqrt(g / f)) - std::sqrt(f * g) * k / 10.0;
    values.push_back(std::sqrt(f / g) * std::tan(angle) + normal(generator));
  }
  return values;
}

TEST(SlowCorrelation, IsNoticedAndWidensTheUncertainty) {
  const Estimate white = Processed(LineProblem(), Line(0, 1))->CurrentEstimate().value();
  EXPECT_THAT(CorrelationOf(white), IsEmpty());
  EXPECT_NEAR(white.channels[0].variance_ratio, 1, 4 * std::sqrt(2.0 / 37));
  EXPECT_EQ(white.channels[0].residual_sums, 37);  // 600 samples in sums of 16

  const Estimate slow = Processed(LineProblem(), Line(0.15, 1))->CurrentEstimate().value();
  EXPECT_LT(slow.channels[0].lag1_correlation, 4 / std::sqrt(600.0));
  EXPECT_THAT(CorrelationOf(slow), HasSubstr("sums of 16 successive residuals vary"));
  EXPECT_LT(slow.channels[0].effective_samples, 0.6 * 600);
  EXPECT_GT(slow.parameters[0].std_dev, 1.2 * white.parameters[0].std_dev);
}

TEST(SlowCorrelation, IsNotSeenInWhiteNoise) {
  for (uint64_t seed = 2; seed < 22; ++seed) {
    const auto estimator = Processed(LineProblem(), Line(0, seed));
    EXPECT_THAT(CorrelationOf(estimator->CurrentEstimate().value()), IsEmpty()) << seed;
  }
}

// The sums are those of a linearized model. In these records its error, which is slow, made them
// vary two to five times as much as those of white noise.
TEST(SlowCorrelation, IsNotSeenInTheErrorOfTheLinearization) {
  for (const uint64_t seed : {5, 16, 21, 43, 46, 49}) {
    const auto estimator = Processed(CoastDown(), Speeds(seed));
    EXPECT_THAT(CorrelationOf(estimator->CurrentEstimate().value()), IsEmpty()) << seed;
  }
}

}  // namespace
}  // namespace polyest::internal
