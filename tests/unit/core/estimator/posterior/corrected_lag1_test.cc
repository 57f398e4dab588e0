// Tests that the lag-1 correlation of an estimate's residuals is that of the errors, whatever the
// frequencies of the predictions that were fitted to them.

#include "core/estimator/posterior/corrected_lag1.h"

#include <absl/strings/str_format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::corrected_lag1_test {
namespace {

constexpr int kSamples = 40;
constexpr int kParameters = 12;
constexpr double kNoise = 0.1;

// Twelve amplitudes of cosines that share a band of the frequencies from 0 to π.
Problem AmplitudesIn(double from, double until) {
  std::string output;
  std::vector<UncertainParameter> amplitudes;
  for (int i = 0; i < kParameters; ++i) {
    const double share = (i + 0.5) / kParameters;
    const double frequency = std::numbers::pi * (from + (until - from) * share);
    output += absl::StrFormat("%sa%d*cos(%.17g*t)", i == 0 ? "" : " + ", i, frequency);
    amplitudes.push_back(UncertainParameter::Normal(absl::StrFormat("a%d", i), 0, 1).value());
  }
  return TextProblem(output, amplitudes, kNoise);
}

// Returns the mean of r over records of white errors.
double MeanLag1(const Problem& problem, int records) {
  double sum = 0;
  for (int seed = 1; seed <= records; ++seed) {
    std::mt19937_64 generator(static_cast<uint64_t>(seed));
    std::normal_distribution<double> normal;
    std::vector<double> values;
    for (int k = 0; k < kSamples; ++k) values.push_back(kNoise * normal(generator));
    sum += Processed(problem, values)->CurrentEstimate().value().channels[0].lag1_correlation;
  }
  return sum / records;
}

// Of N − p = 28 degrees of freedom r has a standard deviation of 1/√28, the mean of 32 records
// that of 1/30. Uncorrected, r is 0.35 too small where low frequencies were fitted, and 0.39 too
// large where high ones were.
TEST(CorrectedLag1, IsThatOfWhiteErrorsInEveryBand) {
  constexpr int kRecords = 32;
  const double error = 4 / std::sqrt((kSamples - kParameters) * kRecords);
  EXPECT_NEAR(MeanLag1(AmplitudesIn(0, 0.3), kRecords), 0, error) << "low";
  EXPECT_NEAR(MeanLag1(AmplitudesIn(0, 1), kRecords), 0, error) << "all";
  EXPECT_NEAR(MeanLag1(AmplitudesIn(0.7, 1), kRecords), 0, error) << "high";
}

TEST(CorrectedLag1, IsNotThereInOneSample) {
  const Problem problem = TextProblem("a", {UncertainParameter::Normal("a", 0, 1).value()}, kNoise);
  const Estimate estimate = Processed(problem, {0.5})->CurrentEstimate().value();
  EXPECT_EQ(estimate.channels[0].lag1_correlation, 0);
  EXPECT_EQ(estimate.channels[0].effective_samples, 1);
}

}  // namespace
}  // namespace polyest::internal::corrected_lag1_test
