// Tests what the windows of a campaign say whose ended runs have been eliminated. The oracle is
// dense linear algebra: y = v t + b with a slope v of its own in each run has, without v, the
// covariance Σ = σ² I + s² t tᵀ in each run.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "core/common/linear_algebra.h"
#include "core/estimator/posterior/robust_covariance.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::windows_of_runs_test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int kRuns = 48, kRows = 20;
constexpr double kNoise = 0.1, kOffset = 0.4, kSlope = 5, kSlopeDeviation = 0.2;

double Time(int i) { return 0.1 * (i + 1); }

Problem RunsProblem() {
  UncertainParameter slope = UncertainParameter::Normal("v", kSlope, kSlopeDeviation).value();
  slope.per_run = true;
  return TextProblem("v*t + b", {slope, UncertainParameter::Normal("b", 0, 1).value()}, kNoise);
}

// Returns runs in which b departs from kOffset by what `change` says of the run.
Samples MakeRuns(uint64_t seed, const std::function<double(int)>& change) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal;
  Samples samples;
  samples.columns = {{"y", {}, {}}};
  for (int run = 0; run < kRuns; ++run) {
    const double slope = kSlope + kSlopeDeviation * normal(generator);
    for (int i = 0; i < kRows; ++i) {
      samples.run.push_back(run);
      samples.time_s.push_back(Time(i));
      samples.columns[0].value.push_back(slope * Time(i) + kOffset + change(run) +
                                         kNoise * normal(generator));
    }
  }
  return samples;
}

const ParameterEstimate& OffsetOf(const Estimate& estimate) { return estimate.parameters.back(); }

// Returns the scores of all ended runs, with b as the only parameter.
std::vector<WindowScore> ExactScores(const Samples& samples, double offset) {
  Vector t(kRows);
  for (int i = 0; i < kRows; ++i) t[i] = Time(i);
  const Matrix covariance = kNoise * kNoise * Matrix::Identity(kRows, kRows) +
                            kSlopeDeviation * kSlopeDeviation * t * t.transpose();
  const Vector weights = CholeskyFactor(covariance).Solve(Vector::Ones(kRows));
  std::vector<WindowScore> scores;
  for (int run = 0; run + 1 < kRuns; ++run) {
    const Eigen::Map<const Vector> y(samples.columns[0].value.data() + run * kRows, kRows);
    WindowScore score{.span = {.rows = kRows}, .score = Vector(1), .information = Matrix(1, 1)};
    score.score[0] = -weights.dot(y - kSlope * t - Vector::Constant(kRows, offset));
    score.information(0, 0) = weights.sum();
    scores.push_back(score);
  }
  return scores;
}

TEST(WindowsOfRuns, GiveTheRobustStandardDeviationOfDenseLinearAlgebra) {
  for (const uint64_t seed : {1, 2}) {
    const Samples samples = MakeRuns(seed, [](int) { return 0.0; });
    const Estimate estimate = EstimateOf(RunsProblem(), samples);
    const ParameterEstimate& offset = OffsetOf(estimate);
    const RobustCovariance exact =
        RobustCovarianceOf(ExactScores(samples, offset.map), Matrix::Identity(1, 1));
    // The estimate has the last run, too, which is in no window.
    EXPECT_NEAR(offset.robust_std_dev, exact.ratio[0] * offset.std_dev, 1e-3 * offset.std_dev);
    EXPECT_NEAR(estimate.disagreement, exact.disagreement, 1e-3);
    EXPECT_THAT(estimate.diagnostics, IsEmpty());
    EXPECT_THAT(estimate.windows, IsEmpty());
  }
}

std::string MessageOf(const Estimate& estimate, DiagnosticCode code) {
  for (const Diagnostic& diagnostic : estimate.diagnostics) {
    if (diagnostic.code == code) return diagnostic.message;
  }
  return "";
}

// One run tells b to 0.05: the halves differ by 0.05 ± 0.05 √(4/48).
TEST(WindowsOfRuns, NameAParameterThatChanges) {
  const Samples samples = MakeRuns(1, [](int run) { return run < kRuns / 2 ? 0 : 0.1; });
  const Estimate estimate = EstimateOf(RunsProblem(), samples);
  const std::string message = MessageOf(estimate, DiagnosticCode::kInconsistentOverTime);
  EXPECT_THAT(message, HasSubstr("b is not constant over the record"));
  EXPECT_THAT(message, HasSubstr("to run 23, 2 s) and"));
  EXPECT_NE(OffsetOf(estimate).verdict, Verdict::kIdentified);
  ASSERT_GE(estimate.windows.size(), 2u);
  EXPECT_EQ(estimate.windows.front().first_run, 0);
  EXPECT_EQ(estimate.windows.back().last_run, kRuns - 2);
}

// An offset that scatters from run to run by D has a mean with the standard deviation D/√R beside
// that of the noise.
TEST(WindowsOfRuns, WidenWhatScattersFromRunToRun) {
  constexpr double kScatter = 0.3;
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal(0, kScatter);
  std::vector<double> changes(kRuns);
  for (double& change : changes) change = normal(generator);
  const Samples samples = MakeRuns(1, [&](int run) { return changes[static_cast<size_t>(run)]; });
  const Estimate estimate = EstimateOf(RunsProblem(), samples);
  EXPECT_THAT(MessageOf(estimate, DiagnosticCode::kWindowsDisagree), HasSubstr("b"));
  // A standard deviation from 12 to 47 windows is known to 10 to 20 %; the largest counts.
  const double expected = kScatter / std::sqrt(kRuns);
  EXPECT_GT(OffsetOf(estimate).robust_std_dev, 0.7 * expected);
  EXPECT_LT(OffsetOf(estimate).robust_std_dev, 1.6 * expected);
}

}  // namespace
}  // namespace polyest::internal::windows_of_runs_test
