// Checks when an estimate is said to rest on samples that are too far apart for its response. What
// a parameter changes between samples is tested with the paper's figure 4, in estimates_test.

#include "core/estimator/posterior/undersampling.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::undersampling_test {
namespace {

using ::testing::HasSubstr;

constexpr double kNoise = 0.02;

// A vibration of unknown frequency w (rad/s) and amplitude, recorded at 20 times.
Estimate VibrationAt(const std::function<double(int)>& time_s, double least_w, double most_w) {
  const Problem problem = TextProblem("a*cos(w*t)*exp(-t/3)",
                                      {*UncertainParameter::Uniform("w", least_w, most_w),
                                       *UncertainParameter::Normal("a", 1, 0.2)},
                                      kNoise);
  Samples samples;
  std::vector<double> values;
  for (int k = 1; k <= 20; ++k) {
    const double t = time_s(k);
    samples.time_s.push_back(t);
    values.push_back(1.1 * std::cos(20 * t) * std::exp(-t / 3) + kNoise * std::sin(17 * k));
  }
  samples.columns = {{"y", values, {}}};
  return EstimateOf(problem, samples);
}

double Even(int k) { return 0.4 * k; }  // 1.3 periods between two samples
double Uneven(int k) { return 0.4 * (k + 0.3 * std::sin(7 * k)); }
double Dense(int k) { return 0.1 * k; }  // 0.3 periods

TEST(Aliasing, IsPossibleWhereSamplesAreRareAndEven) {
  EXPECT_THAT(Message(VibrationAt(Even, 10, 25), DiagnosticCode::kUndersampled),
              HasSubstr(" turning points between two samples"));
}

TEST(Aliasing, IsNotWhereTheyAreUneven) {
  EXPECT_FALSE(Has(VibrationAt(Uneven, 10, 25), DiagnosticCode::kUndersampled));
}

TEST(Aliasing, IsNotWhereTheyAreDense) {
  EXPECT_FALSE(Has(VibrationAt(Dense, 10, 25), DiagnosticCode::kUndersampled));
}

TEST(Aliasing, IsNotWhereThePriorExcludesOtherFrequencies) {
  EXPECT_FALSE(Has(VibrationAt(Even, 19.5, 20.5), DiagnosticCode::kUndersampled));
}

// A decaying vibration of 8.17 rad/s with four unknowns. At 4 samples a second its image has 16.96
// rad/s, and the cost has two minima of about the same value.
Estimate RareVibration(double interval_s) {
  const Problem problem = TextProblem(
      "(a*cos(w*t) + b*sin(w*t))*exp(-d*t)",
      {*UncertainParameter::Uniform("w", 4.5, 28), *UncertainParameter::Normal("a", 0, 1),
       *UncertainParameter::Normal("b", 0, 1), *UncertainParameter::Uniform("d", 0, 0.5)},
      kNoise);
  Samples samples;
  std::vector<double> values;
  for (int k = 1; k <= 30; ++k) {
    const double t = interval_s * k;
    samples.time_s.push_back(t);
    values.push_back((0.6 * std::cos(8.17 * t) - 0.7 * std::sin(8.17 * t)) * std::exp(-0.1 * t) +
                     kNoise * std::sin(17 * k));
  }
  samples.columns = {{"y", values, {}}};
  return EstimateOf(problem, samples);
}

TEST(Aliasing, IsPossibleBelowTwoSamplesAPeriodAndAbove) {
  const Estimate estimate = RareVibration(0.25);
  const double w = estimate.parameters[0].map;
  EXPECT_TRUE(std::abs(w - 8.17) < 0.1 || std::abs(w - 16.96) < 0.1 ||
              estimate.parameters[0].verdict == Verdict::kNotIdentified)
      << w;
  EXPECT_TRUE(Has(estimate, DiagnosticCode::kUndersampled) ||
              Has(estimate, DiagnosticCode::kMultipleMinima));
}

TEST(Aliasing, IsNotWithEightSamplesAPeriod) {
  EXPECT_FALSE(Has(RareVibration(0.1), DiagnosticCode::kUndersampled));
}

}  // namespace
}  // namespace polyest::internal::undersampling_test
