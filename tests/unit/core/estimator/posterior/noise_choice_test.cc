// Tests the choice of a noise with values of the likelihood that are given: where they are those of
// a quadratic function, its minimum is known.

#include "core/estimator/posterior/noise_choice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace polyest::internal {
namespace {

constexpr TimeConstantGrid kGridOfChoices = {0.01, 100};
constexpr NoiseShape kPresentNoise = {2, 0.4};

double LogOdds(const NoiseShape& noise) {
  return std::log(noise.white_share / (1 - noise.white_share));
}

// −log L of the noises that are white in part, with the minimum `least` at `best` and a narrow
// valley along which one may stand for the other; the scale is τ^0.1. White noise has 50, and noise
// without a white share 60.
std::vector<ProfileValue> Values(const CorrelationProfile& profile, const NoiseShape& best,
                                 double least) {
  std::vector<ProfileValue> values;
  for (const NoiseShape& noise : profile.shapes()) {
    ProfileValue& value = values.emplace_back();
    value.scale = noise.time_constant_s > 0 ? std::pow(noise.time_constant_s, 0.1) : 1;
    value.negative_log_likelihood = noise.time_constant_s > 0 ? 60 : 50;
    if (noise.white_share == 0) continue;
    const double x = std::log(noise.time_constant_s / best.time_constant_s);
    const double y = LogOdds(noise) - LogOdds(best);
    value.negative_log_likelihood = least + 40 * (x + y) * (x + y) + (x - y) * (x - y);
  }
  return values;
}

TEST(NoiseChoice, IsTheMinimumOfAQuadraticFunctionOfTheLogarithms) {
  const CorrelationProfile profile(kGridOfChoices, kPresentNoise, 1);
  const NoiseShape best = Neighbour(kPresentNoise, 1.3, -0.9);
  const NoiseChoice choice = ChooseNoise(profile, Values(profile, best, 10), kGridOfChoices);
  EXPECT_NEAR(choice.noise.time_constant_s, best.time_constant_s, 1e-9);
  EXPECT_NEAR(choice.noise.white_share, best.white_share, 1e-9);
  EXPECT_NEAR(choice.negative_log_likelihood, 10, 1e-9);
  EXPECT_NEAR(choice.scale, std::pow(best.time_constant_s, 0.1), 1e-9);
  EXPECT_NEAR(std::log(kGridOfChoices.At(choice.step) / best.time_constant_s), 0,
              0.5 * std::log(kGridOfChoices.At(1) / kGridOfChoices.At(0)));
}

// The bounds of a step cut the valley; the best that they leave is on their edge.
TEST(NoiseChoice, GoesNoFurtherThanItsStepsReach) {
  const CorrelationProfile profile(kGridOfChoices, kPresentNoise, 1);
  const NoiseShape best = Neighbour(kPresentNoise, 3, -3);
  std::vector<ProfileValue> values = Values(profile, best, 10);
  for (size_t i = CorrelationProfile::kFirstMixed; i < CorrelationProfile::kFirstNeighbour; ++i) {
    values[i].negative_log_likelihood = 60;
  }
  for (size_t i = CorrelationProfile::kFirstNeighbour + 9; i < values.size(); ++i) {
    values[i].negative_log_likelihood = 60;
  }
  const NoiseChoice choice = ChooseNoise(profile, values, kGridOfChoices);
  EXPECT_LE(std::log(choice.noise.time_constant_s / 2), 2 * kStepOfTimeConstant + 1e-12);
  EXPECT_GE(LogOdds(choice.noise) - LogOdds(kPresentNoise), -2 * kStepOfShare - 1e-12);
  EXPECT_LT(choice.negative_log_likelihood,
            values[CorrelationProfile::kFirstNeighbour + 4].negative_log_likelihood);
}

TEST(NoiseChoice, IsOfTheGridAtFirst) {
  const CorrelationProfile profile(kGridOfChoices, NoiseShape(), 1);
  std::vector<ProfileValue> values = Values(profile, {1, 0.5}, 10);
  const size_t best = CorrelationProfile::kFirstMixed + 47;
  values[best].negative_log_likelihood = 5;
  const NoiseChoice choice = ChooseNoise(profile, values, kGridOfChoices);
  EXPECT_EQ(choice.noise, profile.shapes()[best]);
  EXPECT_EQ(choice.scale, values[best].scale);
}

// Each parameter of the noise must gain 1.
TEST(NoiseChoice, HasNoShareThatGainsTooLittle) {
  const CorrelationProfile profile(kGridOfChoices, kPresentNoise, 1);
  std::vector<ProfileValue> values = Values(profile, kPresentNoise, 48.1);
  EXPECT_EQ(ChooseNoise(profile, values, kGridOfChoices).noise, NoiseShape());
  values = Values(profile, kPresentNoise, 47.9);
  EXPECT_GT(ChooseNoise(profile, values, kGridOfChoices).noise.white_share, 0);
  const size_t correlated = CorrelationProfile::kFirstOfGrid + 8;
  values[correlated].negative_log_likelihood = 48.7;
  EXPECT_EQ(ChooseNoise(profile, values, kGridOfChoices).noise.white_share, 0);
  EXPECT_GT(ChooseNoise(profile, values, kGridOfChoices).noise.time_constant_s, 0);
  values[correlated].negative_log_likelihood = 49;
  EXPECT_GT(ChooseNoise(profile, values, kGridOfChoices).noise.white_share, 0);
}

TEST(NoiseChoice, IsAboutTheSameWithinFivePercent) {
  EXPECT_TRUE(IsAbout({}, {}));
  EXPECT_TRUE(IsAbout({1, 0}, {1.04, 0}));
  EXPECT_FALSE(IsAbout({1, 0}, {1.06, 0}));
  EXPECT_FALSE(IsAbout({1, 0}, {}));
  EXPECT_FALSE(IsAbout({1, 0}, {1, 0.01}));
  EXPECT_TRUE(IsAbout({1, 0.5}, {1, 0.51}));
  EXPECT_FALSE(IsAbout({1, 0.99}, {1, 0.992}));
}

}  // namespace
}  // namespace polyest::internal
