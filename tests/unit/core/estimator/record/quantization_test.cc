// Tests which samples are recognized as rounded to coarse steps, on rounded signals whose noise is
// known.

#include "core/estimator/record/quantization.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>

namespace polyest::internal::quantization_test {
namespace {

constexpr double kStep = 0.1;

// Returns the facts of rounded samples of signal(k) with normal noise.
ColumnFacts RoundedFacts(const std::function<double(int)>& signal, double noise, int samples,
                         uint64_t seed) {
  std::mt19937_64 generator(seed);
  std::normal_distribution<double> normal(0, noise);
  ColumnFacts facts;
  for (int k = 0; k < samples; ++k) {
    const double value = std::round((signal(k) + normal(generator)) / kStep) * kStep;
    facts.Add(value, noise);
    facts.faults.Add(value);
  }
  return facts;
}

// Returns the noise as a user who knows of the rounding gives it.
double WithRounding(double noise) { return std::sqrt(noise * noise + kStep * kStep / 12); }

// Slow beside the noise: 0.3 mm from sample to sample at most.
double Slow(int k) { return 0.5 * std::sin(0.005 * k); }

TEST(CoarseSteps, AreFoundBesideSmallNoise) {
  constexpr int kSamples = 4'000;
  for (const double ratio : {5.0, 10.0}) {
    const double noise = kStep / ratio;
    const auto found =
        FindCoarseSteps(RoundedFacts(Slow, noise, kSamples, 1), {WithRounding(noise)});
    ASSERT_TRUE(found) << ratio;
    EXPECT_NEAR(found->step, kStep, 1e-9);
    // N p changes with p = 2s/(√π q), in pairs, so that their number has a standard deviation below
    // √(2 N p); and the place within the steps is not quite uniform.
    const double changes = kSamples * 2 / std::sqrt(std::numbers::pi) / ratio;
    EXPECT_NEAR(found->noise / noise, 1, 4 * std::sqrt(2 / changes) + 0.05) << ratio;
  }
}

TEST(CoarseSteps, AreNotFoundBesideNoiseOfHalfAStep) {
  for (const int samples : {25, 50, 200, 1'000}) {
    for (uint64_t seed = 0; seed < 200; ++seed) {
      for (const double noise : {kStep / 2, kStep}) {
        // At rest in each place within a step, and slow.
        const double place = kStep * static_cast<double>(seed) / 200;
        const auto rest = [place](int) { return place; };
        EXPECT_FALSE(
            FindCoarseSteps(RoundedFacts(rest, noise, samples, seed), {WithRounding(noise)}));
        EXPECT_FALSE(
            FindCoarseSteps(RoundedFacts(Slow, noise, samples, seed), {WithRounding(noise)}));
      }
    }
  }
}

// The noise learned scatters by 1/√(2N) of it about the right size.
TEST(CoarseSteps, AreHardlyFoundByChanceWhereTheNoiseIsLearned) {
  const double noise = kStep / 2;
  for (const int samples : {25, 50, 200, 1'000}) {
    const double low = (1 - 3.5 / std::sqrt(2.0 * samples)) * WithRounding(noise);
    EXPECT_FALSE(FindCoarseSteps(RoundedFacts(Slow, noise, samples, 1), {low, true, low}));
  }
}

// The rounding errors of a signal that moves by steps from sample to sample are independent.
TEST(CoarseSteps, AreNotFoundWhereTheSignalMoves) {
  const auto fast = [](int k) { return 10 * std::sin(0.04 * k); };
  EXPECT_FALSE(
      FindCoarseSteps(RoundedFacts(fast, kStep / 10, 1'000, 1), {WithRounding(kStep / 10)}));
}

TEST(CoarseSteps, AreNotFoundWhereTheNoiseStatedCoversThem) {
  EXPECT_FALSE(FindCoarseSteps(RoundedFacts(Slow, kStep / 10, 1'000, 1), {kStep / 2}));
}

// A switch has two values, too, but a model of it leaves no residuals.
TEST(CoarseSteps, AreFoundInFewValuesByTheResiduals) {
  const ColumnFacts facts =
      RoundedFacts([](int k) { return 0.07 + 0.0001 * k; }, kStep / 10, 300, 1);
  ASSERT_LT(facts.distinct.size(), 4u);
  const double noise = WithRounding(kStep / 10);
  EXPECT_TRUE(FindCoarseSteps(facts, {noise, false, 0.2 * kStep}));
  EXPECT_FALSE(FindCoarseSteps(facts, {noise, false, 1e-3 * kStep}));
  EXPECT_FALSE(FindCoarseSteps(facts, {noise}));
}

}  // namespace
}  // namespace polyest::internal::quantization_test
