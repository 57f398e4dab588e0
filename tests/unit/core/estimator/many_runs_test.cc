// Tests campaigns of more runs than an expansion has room for, so that the parameters of ended runs
// are eliminated. The oracles are the exact posteriors.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/testing/campaign.h"
#include "tests/testing/records.h"
#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;

std::vector<std::string> NamesIn(const Estimate& estimate) {
  std::vector<std::string> names;
  for (const ParameterEstimate& parameter : estimate.parameters) names.push_back(parameter.name);
  return names;
}

const ParameterEstimate& Find(const Estimate& estimate, const std::string& name) {
  return *std::ranges::find(estimate.parameters, name, &ParameterEstimate::name);
}

// A thousandth of the noise is left of the expansion's error, which moves the means by 0.01
// standard deviations at most; the draws of the posterior scatter by 0.03.
void ExpectAgreement(const ParameterEstimate& parameter, double mean, double std_dev) {
  SCOPED_TRACE(parameter.name);
  EXPECT_NEAR(parameter.map, mean, 0.02 * std_dev);
  EXPECT_NEAR(parameter.mean, mean, 0.05 * std_dev);
  EXPECT_NEAR(parameter.std_dev, std_dev, 0.01 * std_dev);
  EXPECT_NEAR(parameter.posterior_std_dev, std_dev, 0.02 * std_dev);
}

TEST(ManyRuns, AgreeWithTheExactPosterior) {
  const Samples samples = Campaign::MakeRuns(200);
  const Estimate estimate = EstimateOf(Campaign::MakeProblem(), samples);
  const CampaignOracle oracle = OracleOf(samples);
  ASSERT_THAT(NamesIn(estimate), ElementsAre("k", "v_0[199]", "c"));
  ExpectAgreement(Find(estimate, "k"), oracle.mode[0], std::sqrt(oracle.covariance(0, 0)));
  ExpectAgreement(Find(estimate, "c"), oracle.mode[1], std::sqrt(oracle.covariance(1, 1)));
  ExpectAgreement(Find(estimate, "v_0[199]"), oracle.last_velocity, oracle.last_deviation);
  // χ² is over all runs. Each has used up one degree of freedom; its standard deviation is √(2N).
  const ChannelEstimate& channel = estimate.channels[0];
  const double degrees = 200.0 * (Campaign::kRowsPerRun - 1);
  EXPECT_EQ(channel.samples, 200 * Campaign::kRowsPerRun);
  EXPECT_NEAR(channel.chi_squared, degrees, 4 * std::sqrt(2 * degrees));
  EXPECT_THAT(estimate.diagnostics, ::testing::IsEmpty());
}

// Runs of four samples, y = a + d t + b t², with a and d of their own: of 600 samples half the
// degrees of freedom are left. The residuals of linear least squares are the oracle: χ² is s² times
// one of 299 degrees of freedom where the noise is s times as large as assumed.
TEST(ManyRuns, AreJudgedByTheDegreesOfFreedomThatTheirOwnParametersLeave) {
  constexpr int kCount = 150, kRows = 4;
  constexpr double kAssumed = 0.05;
  UncertainParameter level = UncertainParameter::Normal("a", 0, 1).value();
  UncertainParameter slope = UncertainParameter::Normal("d", 0, 1).value();
  level.per_run = slope.per_run = true;
  const Problem problem = TextProblem(
      "a + d*t + b*t^2", {UncertainParameter::Normal("b", 0, 1).value(), level, slope}, kAssumed);
  const auto estimate = [&](double ratio) {
    std::mt19937_64 generator(5);
    std::normal_distribution<double> normal;
    Samples samples;
    samples.columns = {{"y", {}, {}}};
    for (int run = 0; run < kCount; ++run) {
      const double a = normal(generator), d = normal(generator);
      for (int i = 0; i < kRows; ++i) {
        const double t = 0.5 * i;
        samples.run.push_back(run);
        samples.time_s.push_back(t);
        samples.columns[0].value.push_back(a + d * t + 0.3 * t * t +
                                           ratio * kAssumed * normal(generator));
      }
    }
    return EstimateOf(problem, samples);
  };
  EXPECT_THAT(estimate(1).diagnostics, ::testing::IsEmpty());
  // χ² of about 2.1 ν = 630 is beyond chance, and would not be if ν were N = 600.
  const Estimate noisy = estimate(1.45);
  EXPECT_LT(noisy.channels[0].chi_squared, 1.2 * kCount * kRows);
  EXPECT_THAT(Message(noisy, DiagnosticCode::kModelMisfit),
              ::testing::HasSubstr("residuals are 1.4"));
  EXPECT_THAT(Message(estimate(0.4), DiagnosticCode::kModelMisfit),
              ::testing::HasSubstr("residuals are only 0.39"));
}

// The scale's posterior has a standard deviation of 1/√(2N) of it; the standard deviations of k and
// c are in proportion to the scale.
TEST(ManyRuns, TeachTheNoise) {
  Problem problem = Campaign::MakeProblem();
  problem.measured[0].noise = {.absolute = 1, .unknown = true};
  constexpr double kNoise = 0.03;
  constexpr int kRuns = 60;
  const Samples samples = Campaign::MakeRuns(kRuns, kNoise);
  const Estimate estimate = EstimateOf(problem, samples);
  const double scatter = 1 / std::sqrt(2.0 * kRuns * (Campaign::kRowsPerRun - 1));
  EXPECT_NEAR(estimate.channels[0].noise_std_dev, kNoise, 4 * scatter * kNoise);
  const CampaignOracle oracle = OracleOf(samples, estimate.channels[0].noise_std_dev);
  ExpectAgreement(Find(estimate, "k"), oracle.mode[0], std::sqrt(oracle.covariance(0, 0)));
  ExpectAgreement(Find(estimate, "c"), oracle.mode[1], std::sqrt(oracle.covariance(1, 1)));
}

TEST(ManyRuns, HowTheirRecordIsCutIntoBatchesDoesNotMatter) {
  const Samples all = Campaign::MakeRuns(30);
  const Estimate whole = EstimateOf(Campaign::MakeProblem(), all);
  EstimatorOptions options;
  options.threads = 2;
  const auto estimator = MakeEstimator(Campaign::MakeProblem(), options);
  for (size_t first = 0; first < all.rows(); first += 31) {
    ASSERT_TRUE(estimator->Append(testing::Rows(all, first, 31)).ok());
    ASSERT_TRUE(estimator->Process().ok());
    ASSERT_TRUE(estimator->CurrentEstimate().ok());
  }
  ExpectSame(estimator->CurrentEstimate().value(), whole);
}

// Predictions of ended runs take their initial velocities from what is kept of them.
TEST(ManyRuns, ArePredictedEach) {
  const auto estimator = MakeEstimator(Campaign::MakeProblem());
  ASSERT_TRUE(estimator->Append(Campaign::MakeRuns(15)).ok());
  ASSERT_TRUE(estimator->Process().ok());
  const auto prediction = estimator->CurrentPrediction({});
  ASSERT_TRUE(prediction.ok()) << prediction.status();
  const Vector& residuals = prediction->outputs[0].standardized_residual;
  ASSERT_EQ(residuals.size(), 15 * Campaign::kRowsPerRun);
  EXPECT_NEAR(std::sqrt(residuals.squaredNorm() / static_cast<double>(residuals.size())), 1, 0.15);
}

// A decay from an unknown level in each run that has a square root as its parameter, y = a² e^(−k
// t), with levels at the bounds of their prior.
struct Decay {
  static constexpr double kNoise = 0.05, kLower = 0.3, kUpper = 1;
  static constexpr int kRuns = 30, kRows = 15;

  static double Output(double k, double a, double t) { return a * a * std::exp(-k * t); }
  static Problem MakeProblem() {
    UncertainParameter level = UncertainParameter::Uniform("a", kLower, kUpper).value();
    level.per_run = true;
    return TextProblem("a^2 * exp(-k*t)",
                       {UncertainParameter::Normal("k", 1, 0.3).value(), std::move(level)}, kNoise);
  }
  static Samples MakeRuns() {
    std::mt19937_64 generator(3);
    std::normal_distribution<double> normal;
    Samples samples;
    samples.columns = {{"y", {}, {}}};
    for (int run = 0; run < kRuns; ++run) {
      const double a = kLower + (kUpper - kLower) * (run % 4) / 3;
      for (int i = 1; i <= kRows; ++i) {
        samples.run.push_back(run);
        samples.time_s.push_back(0.2 * i);
        samples.columns[0].value.push_back(Output(1.1, a, 0.2 * i) + kNoise * normal(generator));
      }
    }
    return samples;
  }
};

// Returns −log of the posterior density of k, each run's level integrated by the midpoint rule.
double DecayCost(const Samples& samples, double k) {
  constexpr int kNodes = 400;
  double cost = 0.5 * std::pow((k - 1) / 0.3, 2);
  for (int run = 0; run < Decay::kRuns; ++run) {
    Vector costs = Vector::Zero(kNodes);
    for (int q = 0; q < kNodes; ++q) {
      const double a = Decay::kLower + (Decay::kUpper - Decay::kLower) * (q + 0.5) / kNodes;
      for (int i = 0; i < Decay::kRows; ++i) {
        const auto row = static_cast<size_t>(run * Decay::kRows + i);
        const double error =
            samples.columns[0].value[row] - Decay::Output(k, a, samples.time_s[row]);
        costs[q] += 0.5 * error * error / Decay::kNoise / Decay::kNoise;
      }
    }
    const double least = costs.minCoeff();
    cost += least - std::log((least - costs.array()).exp().sum());
  }
  return cost;
}

TEST(ManyRuns, OfANonlinearModelWithLevelsAtABoundAgreeWithQuadrature) {
  const Samples samples = Decay::MakeRuns();
  const Estimate estimate = EstimateOf(Decay::MakeProblem(), samples);
  const ParameterEstimate& k = Find(estimate, "k");
  // A grid of ±5 standard deviations, on which sums of a smooth density are exact to 10⁻³.
  constexpr int kGrid = 21;
  Vector deviate(kGrid), costs(kGrid);
  for (int i = 0; i < kGrid; ++i) {
    deviate[i] = 5 * (2.0 * i / (kGrid - 1) - 1);
    costs[i] = DecayCost(samples, k.mean + deviate[i] * k.posterior_std_dev);
  }
  Vector density = (costs.minCoeff() - costs.array()).exp();
  density /= density.sum();
  const double mean = density.dot(deviate);
  EXPECT_NEAR(mean, 0, 0.1);
  EXPECT_NEAR(std::sqrt(density.dot(deviate.cwiseAbs2()) - mean * mean), 1, 0.05);
}

// Runs of two samples, y = a + b t, with b of their own from an exponential distribution, which
// begins at a bound. The oracle integrates each run's b > 0 in closed form, and a on a grid.
TEST(ManyRuns, WithPriorsThatEndAtABoundAgreeWithQuadrature) {
  constexpr int kCount = 80;
  constexpr double kError = 0.5, kScale = 0.5;
  UncertainParameter slope = UncertainParameter::Gamma("b", 1, kScale, 0).value();
  slope.per_run = true;
  std::mt19937_64 generator(9);
  std::normal_distribution<double> normal(0, kError);
  std::exponential_distribution<double> exponential(1 / kScale);
  Samples samples;
  samples.columns = {{"y", {}, {}}};
  for (int run = 0; run < kCount; ++run) {
    const double b = exponential(generator);
    for (const double t : {1.0, 2.0}) {
      samples.run.push_back(run);
      samples.time_s.push_back(t);
      samples.columns[0].value.push_back(0.3 + b * t + normal(generator));
    }
  }
  const auto log_density = [&](double a) {
    double sum = -0.5 * a * a;
    for (size_t first = 0; first < samples.rows(); first += 2) {
      // −½ Σ (y − a − b t)²/σ² − b/s = −½ A b² + B b − ½ C
      double A = 0, B = -1 / kScale, C = 0;
      for (const size_t row : {first, first + 1}) {
        const double t = samples.time_s[row], e = samples.columns[0].value[row] - a;
        A += t * t / (kError * kError);
        B += t * e / (kError * kError);
        C += e * e / (kError * kError);
      }
      sum += 0.5 * B * B / A - 0.5 * C + std::log(std::erfc(-B / std::sqrt(2 * A)));
    }
    return sum;
  };
  Vector grid = Vector::LinSpaced(4001, -1, 1.5);
  Vector weights = grid.unaryExpr(log_density);
  weights = (weights.array() - weights.maxCoeff()).exp();
  weights /= weights.sum();
  const double mean = weights.dot(grid);
  const double deviation = std::sqrt(weights.dot((grid.array() - mean).square().matrix()));
  const Estimate estimate = EstimateOf(
      TextProblem("a + b*t", {UncertainParameter::Normal("a", 0, 1).value(), slope}, kError),
      samples);
  const ParameterEstimate& a = Find(estimate, "a");
  EXPECT_NEAR(a.mean, mean, 0.1 * deviation);
  EXPECT_NEAR(a.posterior_std_dev, deviation, 0.05 * deviation);
}

}  // namespace
}  // namespace polyest::internal
