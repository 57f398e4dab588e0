// Elements that are bisected: posteriors that no single expansion over the prior can follow. The
// oracles are the exact posteriors on a grid.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <string>

#include "tests/unit/core/estimator/text_problem.h"

namespace polyest::internal::elements_test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr double kNoise = 0.1;

Problem Frequency(const NoiseModel& noise) {
  Problem problem =
      TextProblem("cos(2*pi*f*t)", {UncertainParameter::Uniform("f", 0.5, 5.5).value()}, 1);
  problem.measured.front().noise = noise;
  return problem;
}

// Returns samples of a cosine with white noise at the times given.
Samples CosineAt(std::vector<double> time_s, double frequency, uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal(0, kNoise);
  Samples samples;
  samples.columns = {{"y", {}, {}}};
  for (const double t : time_s) {
    samples.columns.front().value.push_back(std::cos(2 * std::numbers::pi * frequency * t) +
                                            normal(generator));
  }
  samples.time_s = std::move(time_s);
  return samples;
}

std::vector<double> IrregularTimes(uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::uniform_real_distribution<double> uniform(0, 40);
  std::vector<double> times(60);
  for (double& t : times) t = uniform(generator);
  std::ranges::sort(times);
  return times;
}

double HalfSquares(const Samples& samples, double frequency) {
  double sum = 0;
  for (size_t i = 0; i < samples.time_s.size(); ++i) {
    const double y = std::cos(2 * std::numbers::pi * frequency * samples.time_s[i]);
    sum += 0.5 * std::pow((samples.columns.front().value[i] - y) / kNoise, 2);
  }
  return sum;
}

struct Moments {
  double mean = 0;
  double std_dev = 0;
};

// Integrates the posterior on a grid of ±`half` about the frequency that a coarser grid finds best.
Moments ExactOf(const Samples& samples) {
  constexpr double kCoarse = 1e-3, kHalf = 3e-3;
  constexpr int kNodes = 2'001;
  double best = 0.5;
  for (double f = 0.5; f < 5.5; f += kCoarse) {
    if (HalfSquares(samples, f) < HalfSquares(samples, best)) best = f;
  }
  const double least = HalfSquares(samples, best);
  double mass = 0, first = 0, second = 0;
  for (int i = 0; i < kNodes; ++i) {
    const double away = kHalf * (2.0 * i / (kNodes - 1) - 1);
    const double weight = std::exp(least - HalfSquares(samples, best + away));
    mass += weight;
    first += weight * away;
    second += weight * away * away;
  }
  const double mean = first / mass;
  return {best + mean, std::sqrt(second / mass - mean * mean)};
}

Estimate EstimateFrom(const Problem& problem, const Samples& samples) {
  const auto estimator = MakeEstimator(problem);
  EXPECT_TRUE(estimator->Append(samples).ok());
  EXPECT_TRUE(estimator->Process().ok());
  return estimator->CurrentEstimate().value();
}

// Returns the number of turning points between two samples that UNDERSAMPLED tells.
double TurningPointsOf(const Estimate& estimate) {
  const std::string message = Message(estimate, DiagnosticCode::kUndersampled);
  const size_t end = message.find(" turning points");
  if (end == std::string::npos) return 0;
  return std::stod(message.substr(message.rfind(' ', end - 1)));
}

// Over the prior the last sample has 200 periods, and wrong frequencies fit the first ones.
TEST(Elements, FindTheFrequencyOfIrregularSamples) {
  for (const uint64_t seed : {1, 2, 3}) {
    const Samples samples = CosineAt(IrregularTimes(seed), 1.7 * static_cast<double>(seed), seed);
    const Moments exact = ExactOf(samples);
    const Estimate estimate = EstimateFrom(Frequency({.absolute = kNoise}), samples);
    const ParameterEstimate& f = estimate.parameters.front();
    EXPECT_NEAR(f.mean, exact.mean, 0.05 * exact.std_dev) << seed;
    EXPECT_NEAR(f.posterior_std_dev, exact.std_dev, 0.05 * exact.std_dev) << seed;
    EXPECT_THAT(estimate.components, IsEmpty()) << seed;
    EXPECT_FALSE(Has(estimate, DiagnosticCode::kExpansionInaccurate)) << seed;
    EXPECT_FALSE(Has(estimate, DiagnosticCode::kModelMisfit)) << seed;
    EXPECT_LT(estimate.expansion.trajectories, 250) << seed;
  }
}

// At whole seconds f and f + 1 give the same samples, and so do f and −f.
TEST(Elements, FindEveryAliasOfRegularSamples) {
  std::vector<double> times(40);
  for (size_t i = 0; i < times.size(); ++i) times[i] = static_cast<double>(i + 1);
  const Estimate estimate = EstimateFrom(Frequency({.absolute = kNoise}), CosineAt(times, 3.2, 1));
  ASSERT_THAT(estimate.components, SizeIs(10));
  for (const ComponentEstimate& piece : estimate.components) {
    EXPECT_NEAR(piece.weight, 0.1, 0.005);
    EXPECT_NEAR(std::abs(std::remainder(piece.parameters.front().mean, 1)), 0.2, 0.002);
  }
  EXPECT_THAT(Message(estimate, DiagnosticCode::kMultipleMinima), HasSubstr("10 separated pieces"));
}

// A released oscillator with about two samples a period. The image k = 82 of k = 46 has 2.5 % of
// the posterior; draws after the first eight samples may have nothing there, so that elements must
// not be united on them.
TEST(Elements, KeepTheImageOfAVibrationInFourUnknowns) {
  const std::vector<UncertainParameter> uncertain = {
      UncertainParameter::Lognormal("k", 41.5, 11.6).value(),
      UncertainParameter::Lognormal("c", 0.352, 0.179).value(),
      UncertainParameter::Normal("x", 1, 0.277).value(),
      UncertainParameter::Normal("v", 0, 0.587).value()};
  const Problem problem = TextProblem(
      "exp(-c*t/2)*(x*cos(sqrt(k - c^2/4)*t) + (v + c*x/2)/sqrt(k - c^2/4)"
      "*sin(sqrt(k - c^2/4)*t))",
      uncertain, 0.4);
  Samples samples;
  samples.columns = {{"y",
                      {-1.853, 0.959, 0.075, -0.457, 0.739,  -1.831, 0.782,  -0.141,
                       0.378,  0.581, 0.253, 0.059,  -0.393, 0.579,  -0.562, 0.374,
                       -0.085, 0.390, 0.783, -1.000, 1.151,  -0.158, -0.065, -0.809},
                      {}}};
  for (int i = 1; i <= 24; ++i) samples.time_s.push_back(0.397 * i);
  const Estimate estimate = EstimateFrom(problem, samples);
  const ParameterEstimate& k = estimate.parameters.front();
  // On a grid over k and c, with x and v integrated in closed form.
  EXPECT_NEAR(k.mean, 46.81, 0.1 * 5.62);
  EXPECT_NEAR(k.posterior_std_dev, 5.62, 0.1 * 5.62);
  // Of a vibration of frequency w, w Δt/π turning points are between two samples.
  EXPECT_NEAR(TurningPointsOf(estimate), std::sqrt(k.map) * 0.397 / std::numbers::pi, 0.02);
}

TEST(Elements, FollowTheNoiseWhileItIsLearned) {
  const Samples samples = CosineAt(IrregularTimes(5), 4.4, 5);
  const Moments exact = ExactOf(samples);
  const Estimate estimate = EstimateFrom(Frequency({.unknown = true}), samples);
  EXPECT_NEAR(estimate.parameters.front().mean, exact.mean, exact.std_dev);
  EXPECT_NEAR(estimate.channels.front().noise_std_dev, kNoise, 0.03);
}

TEST(Elements, AreTheSameBitsForAnyBatches) {
  const Samples samples = CosineAt(IrregularTimes(2), 3.4, 2);
  const Problem problem = Frequency({.absolute = kNoise});
  const Estimate at_once = EstimateFrom(problem, samples);
  const auto estimator = MakeEstimator(problem);
  for (size_t i = 0; i < samples.time_s.size(); ++i) {
    Samples one;
    one.time_s = {samples.time_s[i]};
    one.columns = {{"y", {samples.columns.front().value[i]}, {}}};
    ASSERT_TRUE(estimator->Append(one).ok());
    ASSERT_TRUE(estimator->Process().ok());
  }
  const Estimate streamed = estimator->CurrentEstimate().value();
  EXPECT_EQ(streamed.parameters.front().mean, at_once.parameters.front().mean);
  EXPECT_EQ(streamed.parameters.front().lower95, at_once.parameters.front().lower95);
  EXPECT_EQ(streamed.expansion.trajectories, at_once.expansion.trajectories);
}

// The data lie five standard deviations of the prior away, where no collocation point is.
TEST(Elements, MoveToWhereANormalPriorHardlyReaches) {
  const double data[] = {5.3, 4.4, 5.9, 5.1, 4.6};
  const Problem problem =
      TextProblem("a + 0*t", {UncertainParameter::Normal("a", 0, 1).value()}, 0.5);
  const Estimate estimate =
      Processed(problem, {std::begin(data), std::end(data)})->CurrentEstimate().value();
  // The conjugate posterior.
  const double precision = 1 + 5 / 0.25;
  double sum = 0;
  for (const double z : data) sum += z / 0.25;
  EXPECT_NEAR(estimate.parameters.front().mean, sum / precision, 1e-3 / std::sqrt(precision));
  EXPECT_NEAR(estimate.parameters.front().posterior_std_dev, 1 / std::sqrt(precision), 1e-3);
  EXPECT_FALSE(Has(estimate, DiagnosticCode::kExpansionInaccurate));
}

}  // namespace
}  // namespace polyest::internal::elements_test
