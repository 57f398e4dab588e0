// Tests parameters that drift. The oracle of the random walk of a measured number (the local level
// model) is its exact Kalman filter, with the number's value at the beginning among its states.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>

#include "core/estimator/problem/drifting_model.h"
#include "core/estimator/problem/resolved_problem.h"
#include "polyest/equation_model.h"
#include "tests/unit/core/estimator/estimation.h"
#include "tests/unit/core/estimator/local_level.h"

namespace polyest::internal {
namespace {

// Means may differ from the exact ones by the error of the posterior's draws, which is 0.02
// standard deviations for an effective number of 2,000. The truncation adds little at this order;
// at the default one it adds up to the shift at which an expansion is settled again, 0.08.
constexpr int kFineOrder = 6;
constexpr double kOfDraws = 0.05;

using ::testing::HasSubstr;

// The exact level is a normal distribution, and a normal prior's level is linear in the germ, so
// that only the draws of the posterior differ: by 1 % of a standard deviation for 10⁴ of them.
TEST(Drift, OfALevelIsThatOfTheExactFilter) {
  const Samples samples = Walk(200, 1);
  const Estimate estimate = EstimateOf(DriftingLevel(), samples);
  const LocalLevel exact = ExactFilter(samples, kRate);
  ASSERT_EQ(estimate.filtered.size(), 2u);
  EXPECT_EQ(estimate.filtered[0].name, "z");
  EXPECT_EQ(estimate.filtered[0].std_dev, 0);
  const FilteredQuantity& now = estimate.filtered[1];
  const double deviation = std::sqrt(exact.variance);
  EXPECT_EQ(now.name, "a");
  EXPECT_EQ(now.unit, "N");
  EXPECT_NEAR(now.mean, exact.mean, 0.01 * deviation);
  EXPECT_NEAR(now.std_dev, deviation, 0.01 * deviation);
  EXPECT_NEAR(now.lower95, exact.mean - 1.96 * deviation, 0.03 * deviation);
  EXPECT_NEAR(now.upper95, exact.mean + 1.96 * deviation, 0.03 * deviation);
}

TEST(Drift, NeedsNoStatesOfTheModel) {
  const Samples samples = Walk(100, 1);
  Problem problem = DriftingLevel();
  const Estimate with_state = EstimateOf(problem, samples);
  problem.model =
      MakeEquationModel({.outputs = {{"y", "a"}}, .parameters = {{"a", 1}}, .units = {{"a", "N"}}})
          .value();
  const Estimate estimate = EstimateOf(problem, samples);
  ASSERT_EQ(estimate.filtered.size(), 1u);
  EXPECT_NEAR(estimate.filtered[0].mean, with_state.filtered[1].mean, 1e-9);
  EXPECT_NEAR(estimate.filtered[0].std_dev, with_state.filtered[1].std_dev, 1e-9);
}

// An unknown rate has the posterior ∝ likelihood on a grid of log r, and the level is the mixture.
TEST(Drift, OfUnknownRateIsWeightedByItsEvidence) {
  const Samples samples = Walk(300, 2);
  Problem problem = WithUnknownRate();
  problem.expansion.order = kFineOrder;
  const Estimate estimate = EstimateOf(problem, samples);
  double all = 0, rate = 0, mean = 0, square = 0;
  const double most = ExactFilter(samples, kRate).log_likelihood;
  for (int i = 0; i <= 1000; ++i) {
    const double r = std::exp(std::log(0.01) + i / 1000.0 * std::log(300.0));
    const LocalLevel level = ExactFilter(samples, r);
    const double weight = std::exp(level.log_likelihood - most);
    all += weight;
    rate += weight * r;
    mean += weight * level.mean;
    square += weight * (level.variance + level.mean * level.mean);
  }
  const double deviation = std::sqrt(square / all - mean * mean / (all * all));
  ASSERT_EQ(estimate.parameters.size(), 2u);
  const ParameterEstimate& found = estimate.parameters[1];
  EXPECT_EQ(found.name, "a.drift");
  EXPECT_EQ(found.unit, "(N)/s^0.5");
  EXPECT_EQ(found.verdict, Verdict::kIdentified);
  EXPECT_NEAR(found.mean, rate / all, kOfDraws * found.posterior_std_dev);
  EXPECT_NEAR(estimate.filtered[1].mean, mean / all, 0.03 * deviation);
  EXPECT_NEAR(estimate.filtered[1].std_dev, deviation, 0.03 * deviation);
}

// 95 % intervals hold the level in 19 of 20 records; three standard deviations of a binomial less
// are 16.
TEST(Drift, IntervalsCoverTheLevel) {
  int covered = 0;
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    const Samples samples = Walk(40, seed);
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    double truth = 6;
    for (int i = 0; i < 40; ++i) {
      truth += kRate * std::sqrt(kLevelStepS) * normal(random);
      normal(random);
    }
    const FilteredQuantity a = EstimateOf(DriftingLevel(), samples).filtered[1];
    covered += a.lower95 <= truth && truth <= a.upper95;
  }
  EXPECT_GE(covered, 16);
}

TEST(Drift, KeepsWithinTheBoundsOfThePrior) {
  Problem problem = DriftingLevel();
  problem.uncertain = {UncertainParameter::Uniform("a", 0, 6.2).value()};
  problem.uncertain[0].drift = RandomWalk{.std_dev_per_sqrt_s = kRate};
  const Estimate estimate = EstimateOf(problem, Walk(200, 3));
  const FilteredQuantity& now = estimate.filtered[1];
  EXPECT_GT(now.std_dev, 0);
  EXPECT_GT(now.lower95, 0);
  EXPECT_LT(now.upper95, 6.2);
}

// A step of the normal score is that of the parameter for a normal prior and of the logarithm for a
// lognormal one; others keep their bounds and lead back.
TEST(Drift, IsAStepOfTheNormalScore) {
  const auto normal = UncertainParameter::Normal("a", 3, 0.5).value();
  EXPECT_DOUBLE_EQ(Drifted(normal, 3.2, 0.4), 3.4);
  const auto lognormal = UncertainParameter::Lognormal("a", 3, 0.5).value();
  EXPECT_NEAR(std::log(Drifted(lognormal, 2, 1.5) / 2), 1.5 * lognormal.scale, 1e-14);
  const auto uniform = UncertainParameter::Uniform("a", -1, 1).value();
  // Φ(1) = 0.8413447460685429
  EXPECT_NEAR(Drifted(uniform, 0, 1), 2 * 0.8413447460685429 - 1, 1e-12);
  EXPECT_NEAR(Drifted(uniform, Drifted(uniform, 0.3, 1.1), -1.1), 0.3, 1e-12);
  EXPECT_LE(Drifted(uniform, 0.3, 40), 1);
  EXPECT_EQ(Drifted(uniform, 1, 0), 1);
}

// An oscillator whose stiffness walks: the exact oracle no longer applies, but a filter at the true
// rate must keep the truth within five standard deviations at the end, and constant stiffness is
// rejected by far.
TEST(Drift, FollowsAStiffness) {
  Problem problem;
  problem.model = *FindBuiltinModel("mass_spring_damper");
  problem.fixed = {{"m", 1}, {"x0", 0}, {"c", 0.3}};
  problem.inputs = {{"force", SinusoidInput{.amplitude = 2, .frequency_hz = 0.9, .phase_rad = 0}}};
  problem.uncertain = {UncertainParameter::Normal("k", 40, 4).value()};
  problem.uncertain[0].drift = RandomWalk{.std_dev_per_sqrt_s = 0.4};
  problem.measured = {{"x", {.absolute = 0.005}}};
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal;
  Samples samples;
  samples.columns = {{"x", {}, {}}};
  double k = 41, x = 0, v = 0;
  for (int i = 0; i < 600; ++i) {
    for (int step = 0; step < 100; ++step) {  // symplectic, each half a millisecond
      const double h = 0.0005, t = (i * 100 + step) * h;
      v += h * (2 * std::sin(2 * std::numbers::pi * 0.9 * (t + h / 2)) - k * x - 0.3 * v);
      x += h * v;
      k += 0.4 * std::sqrt(h) * normal(random);
    }
    samples.time_s.push_back((i + 1) * 0.05);
    samples.columns[0].value.push_back(x + 0.005 * normal(random));
  }
  const Estimate estimate = EstimateOf(problem, samples);
  ASSERT_EQ(estimate.filtered.size(), 3u);
  const FilteredQuantity& now = estimate.filtered[2];
  EXPECT_NEAR(now.mean, k, 5 * now.std_dev);
  EXPECT_LT(now.std_dev, 0.6);
  EXPECT_GT(std::abs(k - estimate.parameters[0].mean),
            5 * estimate.parameters[0].posterior_std_dev);
}

// Rate and noise have the posterior ∝ prior · likelihood on a grid of their logarithms.
TEST(Drift, IsToldApartFromTheNoise) {
  const Samples samples = Walk(200, 6);
  Problem problem = DriftingLevel();
  problem.uncertain[0].drift = RandomWalk{.unknown = true, .lower = 0.1, .upper = 1};
  problem.measured[0].noise.absolute = 0.3;
  problem.uncertain.push_back(UncertainParameter::LogUniform("y.noise", 0.1, 0.4).value());
  problem.expansion.order = kFineOrder;
  const Estimate estimate = EstimateOf(problem, samples);
  double all = 0, rate = 0, noise = 0;
  const double most = ExactFilter(samples, kRate).log_likelihood;
  for (int i = 0; i <= 60; ++i) {
    const double r = std::exp(std::log(0.1) + i / 60.0 * std::log(10.0));
    for (int j = 0; j <= 60; ++j) {
      const double sigma = std::exp(std::log(0.1) + j / 60.0 * std::log(4.0));
      const double weight =
          std::exp(ExactFilter(samples, r, samples.rows(), sigma).log_likelihood - most);
      all += weight;
      rate += weight * r;
      noise += weight * sigma;
    }
  }
  ASSERT_EQ(estimate.parameters.size(), 3u);
  const ParameterEstimate& sigma = estimate.parameters[1];
  const ParameterEstimate& walk = estimate.parameters[2];
  EXPECT_EQ(sigma.name, "y.noise");
  EXPECT_EQ(sigma.unit, "N");
  EXPECT_NEAR(sigma.mean, noise / all, kOfDraws * sigma.posterior_std_dev);
  EXPECT_NEAR(walk.mean, rate / all, kOfDraws * walk.posterior_std_dev);
  EXPECT_NEAR(estimate.channels[0].noise_std_dev, sigma.map, 1e-12);
  EXPECT_THAT(estimate.diagnostics, ::testing::IsEmpty());
}

TEST(Drift, RefusesWhatItCannotDo) {
  const auto refusal = [](const std::function<void(Problem&)>& change) {
    Problem problem = DriftingLevel();
    change(problem);
    return std::string(ResolvedProblem::Make(problem).status().message());
  };
  const auto walk = [](RandomWalk random_walk) {
    return [=](Problem& p) { p.uncertain[0].drift = random_walk; };
  };
  EXPECT_EQ(refusal([](Problem&) {}), "");
  EXPECT_EQ(refusal(walk({})),
            "uncertain[0].drift.random_walk.std_dev_per_sqrt_s: 0 must be > 0, or unknown");
  EXPECT_THAT(refusal(walk({.std_dev_per_sqrt_s = -1})), HasSubstr("-1 must be a finite number"));
  EXPECT_THAT(refusal(walk({.std_dev_per_sqrt_s = 1, .lower = 1, .upper = 2})),
              HasSubstr("have no effect without unknown"));
  EXPECT_THAT(refusal(walk({.unknown = true, .lower = 2, .upper = 1})),
              HasSubstr("drift.random_walk.lower: 2 must be above 0 and below upper 1"));
  EXPECT_THAT(refusal(walk({.std_dev_per_sqrt_s = 1, .unknown = true, .lower = 1, .upper = 2})),
              HasSubstr("is given although it is unknown"));
  EXPECT_THAT(refusal([](Problem& p) { p.uncertain[0].name = "y.gain"; }),
              HasSubstr("y.gain is not a parameter of model"));
  EXPECT_THAT(refusal([](Problem& p) { p.likelihood = LikelihoodForm::kOutputError; }),
              HasSubstr("leaves no room for processNoise and drift"));
  EXPECT_THAT(refusal([](Problem& p) { p.uncertain[0].per_run = true; }),
              HasSubstr("uncertain[0].per_run: is not available"));
  EXPECT_THAT(refusal([](Problem& p) {
                p.uncertain.push_back(UncertainParameter::Normal("y.noise", 1, 0.1).value());
              }),
              HasSubstr("uncertain[1]: y.noise must be positive"));
  EXPECT_EQ(refusal([](Problem& p) {
              p.fixed = {{"y.noise", 0}};
            }),
            "fixed.y.noise: 0 must be > 0");
  EXPECT_THAT(refusal([](Problem& p) { p.measured[0].noise.unknown = true; }),
              HasSubstr("make y.noise an uncertain parameter"));
  EXPECT_THAT(refusal([](Problem& p) {
                p.uncertain[0].drift.reset();
                p.fixed = {{"y.noise", 1}};
              }),
              HasSubstr("no parameter \"y.noise\""));
  EXPECT_THAT(refusal([](Problem& p) {
                p.derived = {{"z_0", "2*a"}};
              }),
              HasSubstr("a cannot drift, because others are derived from it"));
}

}  // namespace
}  // namespace polyest::internal
