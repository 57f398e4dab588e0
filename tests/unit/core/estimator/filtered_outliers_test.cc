// Outliers where filters take the samples, of an oscillator that white force noise drives.
// heavy_tail_test.cc compares the filters themselves with brute-force integration.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "polyest/catalogue.h"
#include "tests/unit/core/estimator/snapshot_session.h"

namespace polyest::internal::filtered_outliers_test {
namespace {

using ::testing::HasSubstr;

constexpr double kTrueK = 40, kTrueC = 0.4, kForce = 0.02, kNoiseOfX = 0.005;

Problem ForcedOscillator(OutlierHandling outliers) {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.fixed = {{"m", 1}, {"x0", 1}, {"v0", 0}};
  problem.uncertain = {UncertainParameter::Uniform("k", 32, 48).value(),
                       UncertainParameter::Uniform("c", 0.1, 1).value()};
  problem.measured = {{"x", {.absolute = kNoiseOfX, .outliers = outliers}}};
  problem.process_noise = {{.state = "v", .spectral_density = kForce}};
  return problem;
}

struct Measured {
  Samples samples;
  double x = 0;  // at the end
};

// Returns samples every 0.05 s of the oscillator, by fifty Euler–Maruyama steps of second order
// each; one of 20, or this share of them, is off by 20 standard deviations of the noise.
Measured Measure(int rows, uint64_t seed, double share = 0.05) {
  constexpr int kSteps = 50;
  constexpr double h = 0.05 / kSteps;
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  Samples samples;
  samples.columns = {{"x", {}, {}}};
  double x = 1, v = 0;
  for (int i = 1; i <= rows; ++i) {
    for (int step = 0; step < kSteps; ++step) {
      const double middle = v + h / 2 * (-kTrueK * x - kTrueC * v);
      const double at_middle = x + h / 2 * v;
      v += h * (-kTrueK * at_middle - kTrueC * middle) + std::sqrt(kForce * h) * normal(random);
      x += h * middle;
    }
    const double wild = uniform(random) < share ? (uniform(random) < 0.5 ? -20 : 20) : 0;
    samples.time_s.push_back(0.05 * i);
    samples.columns[0].value.push_back(x + kNoiseOfX * (wild + normal(random)));
  }
  return {samples, x};
}

Samples Part(const Samples& all, size_t first, size_t count) {
  Samples part;
  part.columns = {{all.columns[0].name, {}, {}}};
  for (size_t i = first; i < first + count; ++i) {
    part.time_s.push_back(all.time_s[i]);
    part.columns[0].value.push_back(all.columns[0].value[i]);
  }
  return part;
}

// Returns Σ (error ÷ standard deviation)² of k and c.
double SquaredError(const Estimate& estimate) {
  double sum = 0;
  for (int i = 0; i < 2; ++i) {
    const ParameterEstimate& parameter = estimate.parameters[static_cast<size_t>(i)];
    const double error = parameter.mean - (i == 0 ? kTrueK : kTrueC);
    sum += error * error / (parameter.posterior_std_dev * parameter.posterior_std_dev);
  }
  return sum;
}

// 20 campaigns with k and c each: Σ is a χ² of 40 degrees of freedom, which lies in 16.9 … 73.4
// with the probability 0.998. The Gaussian filter is dragged by the outliers; that its residuals
// are far larger than the noise widens its uncertainty by a factor of three.
TEST(FilteredOutliers, AreCoveredWhereTheGaussianFilterFails) {
  double sum = 0;
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const Samples samples = Measure(300, seed).samples;
    const Estimate estimate = EstimateOf(ForcedOscillator(OutlierHandling::kStudentT), samples);
    sum += SquaredError(estimate);
    EXPECT_FALSE(Has(estimate, DiagnosticCode::kModelMisfit)) << seed;
    if (seed > 3) continue;
    const Estimate dragged = EstimateOf(ForcedOscillator(OutlierHandling::kNone), samples);
    EXPECT_TRUE(Has(dragged, DiagnosticCode::kModelMisfit));
    for (size_t i = 0; i < 2; ++i) {
      EXPECT_LT(2 * estimate.parameters[i].posterior_std_dev,
                dragged.parameters[i].posterior_std_dev);
    }
  }
  EXPECT_GT(sum, 16.9);
  EXPECT_LT(sum, 73.4);
}

TEST(FilteredOutliers, LeaveTheStateWhereItIs) {
  Measured measured = Measure(300, 31);
  measured.samples.columns[0].value.back() = measured.x + 20 * kNoiseOfX;
  const auto error = [&](OutlierHandling outliers) {
    const Estimate estimate = EstimateOf(ForcedOscillator(outliers), measured.samples);
    EXPECT_EQ(estimate.filtered[0].name, "x");
    return std::abs(estimate.filtered[0].mean - measured.x) / kNoiseOfX;
  };
  EXPECT_LT(error(OutlierHandling::kStudentT), 2);
  EXPECT_GT(error(OutlierHandling::kNone), 4);
}

// Without process noise the states are known, and the likelihood is Student's t of the residuals.
TEST(FilteredOutliers, HaveTheLikelihoodOfStudentsTWhereStatesAreKnown) {
  constexpr double kNoise = 0.02;
  std::vector<double> times_s;
  for (int i = 1; i <= 60; ++i) times_s.push_back(0.05 * i);
  Samples samples = InitialVelocityRecord(times_s, 1.1, kNoise);
  for (const size_t i : {7, 22, 43}) samples.columns[0].value[i] += 20 * kNoise;
  Problem problem =
      InitialVelocityProblem(UncertainParameter::Uniform("v0", 0.5, 2).value(), kNoise);
  problem.likelihood = LikelihoodForm::kPredictionError;
  problem.measured[0].noise.outliers = OutlierHandling::kStudentT;
  double sum = 0, first = 0, second = 0, least = 1e9;
  for (double v0 = 0.9; v0 < 1.3; v0 += 1e-4) {
    double cost = 0;
    for (size_t i = 0; i < times_s.size(); ++i) {
      const double u = (samples.columns[0].value[i] - v0 * UnitResponse(times_s[i])) / kNoise;
      cost += 2.5 * std::log1p(u * u / 4);
    }
    least = std::min(least, cost);
    sum += std::exp(-cost + 60);
    first += std::exp(-cost + 60) * v0;
    second += std::exp(-cost + 60) * v0 * v0;
  }
  const double mean = first / sum, std_dev = std::sqrt(second / sum - mean * mean);
  const Estimate estimate = EstimateOf(problem, samples);
  // The mismatch has the discount for the expansion's own error: one that may shift the estimate by
  // half a standard deviation discounts the square of that.
  EXPECT_NEAR(estimate.parameters[0].mean, mean, 0.1 * std_dev);
  EXPECT_NEAR(estimate.parameters[0].posterior_std_dev, std_dev, 0.05 * std_dev);
  EXPECT_NEAR(estimate.cost.mismatch, least, 0.25);
  // A sample is judged when it is taken, by a deviation that includes how far the estimate then was
  // uncertain. The three wild ones are outliers whenever they are judged; others at most once the
  // estimate is certain: their weight (ν + 1) ÷ (ν + u²) is then below a half.
  int64_t certain = 0;
  for (size_t i = 0; i < times_s.size(); ++i) {
    const double u = (samples.columns[0].value[i] - mean * UnitResponse(times_s[i])) / kNoise;
    if (5 / (4 + u * u) < 0.5) ++certain;
  }
  EXPECT_GE(estimate.channels[0].outliers, 3);
  EXPECT_LE(estimate.channels[0].outliers, certain);
}

TEST(FilteredOutliers, DoNotDependOnBatchesThreadsOrSnapshots) {
  const Samples record = Measure(200, 3).samples;
  Problem problem = ForcedOscillator(OutlierHandling::kStudentT);
  problem.integration.samples_between_checkpoints = kInterval;
  const Estimate expected = EstimateOf(problem, record);
  Session session(problem, 2);
  for (size_t first = 0; first < 150; first += 10) session.Take(Part(record, first, 10));
  ASSERT_FALSE(session.rows.empty());
  Session restored(problem);
  ASSERT_TRUE(restored.estimator->Append(Part(record, 0, 150)).ok());
  ASSERT_TRUE(restored.estimator->Restore(session.last).ok());
  for (Session* one : {&session, &restored}) {
    one->Take(Part(record, 150, 50));
    ExpectSame(one->Current(), expected);
  }
}

// Gaussian noise of the stated size costs a little of the information and is not called a misfit.
TEST(FilteredOutliers, MayBeThereWithoutBeingThere) {
  const Samples samples = Measure(300, 8, 0).samples;
  const Estimate tailed = EstimateOf(ForcedOscillator(OutlierHandling::kStudentT), samples);
  const Estimate gaussian = EstimateOf(ForcedOscillator(OutlierHandling::kNone), samples);
  EXPECT_FALSE(Has(tailed, DiagnosticCode::kModelMisfit));
  EXPECT_LE(tailed.channels[0].outliers, 3);
  for (size_t i = 0; i < 2; ++i) {
    const ParameterEstimate &a = tailed.parameters[i], &b = gaussian.parameters[i];
    EXPECT_NEAR(a.mean, b.mean, b.posterior_std_dev);
    EXPECT_LT(a.posterior_std_dev, 1.25 * b.posterior_std_dev);
    EXPECT_GT(a.posterior_std_dev, 0.95 * b.posterior_std_dev);
  }
}

// One of 20 samples is wild; the tails of Student's t hold 0.99 of the others.
TEST(FilteredOutliers, AreExpectedOfSamplesThatArePredicted) {
  const Samples record = Measure(300, 5).samples;
  const auto estimator = MakeEstimator(ForcedOscillator(OutlierHandling::kStudentT));
  ASSERT_TRUE(estimator->Append(record).ok());
  ASSERT_TRUE(estimator->Process().ok());
  const auto prediction = estimator->CurrentPrediction({});
  ASSERT_TRUE(prediction.ok()) << prediction.status();
  const PredictedOutput& x = prediction->outputs[0];
  int inside = 0;
  for (Eigen::Index i = 0; i < x.measured.size(); ++i) {
    inside += x.measured[i] > x.sample_quantiles(i, 0) && x.measured[i] < x.sample_quantiles(i, 2);
  }
  EXPECT_GT(inside, 0.90 * 300);
  EXPECT_LT(inside, 0.97 * 300);
}

TEST(FilteredOutliers, AreNotHandledByHubersWeights) {
  const absl::Status status =
      ResolvedProblem::Make(ForcedOscillator(OutlierHandling::kHuber)).status();
  EXPECT_THAT(std::string(status.message()),
              HasSubstr("measured[0].noise.outliers: HUBER is not available with likelihood "
                        "PREDICTION_ERROR; STUDENT_T is"));
}

}  // namespace
}  // namespace polyest::internal::filtered_outliers_test
