// Tests what samples show of a faulty sensor: that dropouts and clipped samples are noticed, and
// that signals as rigs have them are not taken for either.

#include "core/estimator/record/signal_faults.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <random>

namespace polyest::internal {
namespace {

constexpr int kSamples = 2'000;

// Adds signal(k) with normal noise, after `change` has been applied to it.
SignalFaults FaultsOf(const std::function<double(int)>& signal, double noise,
                      const std::function<double(int, double)>& change) {
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal(0, 1);
  SignalFaults faults;
  for (int k = 0; k < kSamples; ++k) faults.Add(change(k, signal(k) + noise * normal(generator)));
  return faults;
}

double Sine(int k) { return 5 + std::sin(2 * std::numbers::pi * k / 100.0); }
double Unchanged(int, double value) { return value; }
double Rounded(int, double value) { return std::round(value / 0.05) * 0.05; }

void ExpectNone(const SignalFaults& faults) {
  EXPECT_LT(faults.Dropouts().count, 4);
  EXPECT_LT(faults.UpperPlateaus().count, 4);
  EXPECT_LT(faults.LowerPlateaus().count, 4);
  EXPECT_TRUE(faults.IsConsistent());
}

TEST(SignalFaults, AreDropouts) {
  const auto drop_out = [](int k, double value) { return k % 97 < 3 ? 0.0 : value; };
  for (const double noise : {0.0, 0.01, 0.1}) {
    const SignalFaults faults = FaultsOf(Sine, noise, drop_out);
    EXPECT_EQ(faults.Dropouts().value, 0);
    EXPECT_GE(faults.Dropouts().count, 19);  // all but the first, before which there is nothing
    EXPECT_TRUE(faults.IsConsistent());
  }
  // Spikes elsewhere do not hide them while they are fewer.
  const SignalFaults faults = FaultsOf(Sine, 0.01, [&](int k, double value) {
    return k % 211 == 50 ? 9 + 0.01 * k : drop_out(k, value);
  });
  EXPECT_EQ(faults.Dropouts().value, 0);
  EXPECT_GE(faults.Dropouts().count, 15);
}

TEST(SignalFaults, AreDropoutsOfARoundedSignalAtRest) {
  const SignalFaults faults =
      FaultsOf([](int) { return 5.0; }, 0.01,
               [](int k, double value) { return k % 97 == 0 ? 0 : Rounded(k, value); });
  EXPECT_EQ(faults.Dropouts().value, 0);
  EXPECT_GE(faults.Dropouts().count, 19);  // all but the first, which is its first step at all
}

TEST(SignalFaults, AreClippedSamples) {
  const auto clip = [](int, double value) { return std::clamp(value, 4.3, 5.8); };
  for (const double noise : {0.0, 0.003}) {
    const SignalFaults faults = FaultsOf(Sine, noise, clip);
    EXPECT_EQ(faults.UpperPlateaus().value, 5.8);
    EXPECT_GE(faults.UpperPlateaus().count, 20);
    EXPECT_EQ(faults.LowerPlateaus().value, 4.3);
    EXPECT_GE(faults.LowerPlateaus().count, 19);  // the record ends in no plateau
    EXPECT_EQ(faults.Dropouts().count, 0);
  }
}

TEST(SignalFaults, AreNotGoodSignals) {
  ExpectNone(FaultsOf(Sine, 0.01, Unchanged));
  ExpectNone(FaultsOf(Sine, 0, Unchanged));
  ExpectNone(FaultsOf(Sine, 0, Rounded));
  ExpectNone(FaultsOf(Sine, 0.05, Rounded));
  ExpectNone(FaultsOf(Sine, 0.3, Rounded));
  // At rest.
  ExpectNone(FaultsOf([](int) { return 5.0; }, 0, Unchanged));
  ExpectNone(FaultsOf([](int) { return 5.01; }, 0.02, Rounded));
}

TEST(SignalFaults, AreNotEventsOfASignalAtRest) {
  // Blows of many heights, which die out between.
  const auto blows = [](int k) {
    const int since = k % 200;
    return (1 + 0.37 * (k / 200)) * std::exp(-since / 10.0) * std::sin(since * 1.1);
  };
  ExpectNone(FaultsOf(blows, 0.001, Unchanged));
  ExpectNone(FaultsOf(blows, 0, [](int, double value) { return std::round(value * 500) / 500; }));
}

TEST(SignalFaults, AreNotSteps) {
  for (const int length : {1, 2, 7, 50}) {
    const auto square = [&](int k) { return k / length % 2 == 0 ? -1.0 : 1.0; };
    EXPECT_EQ(FaultsOf(square, 0, Unchanged).Dropouts().count, 0) << length;
    ExpectNone(FaultsOf(square, 0.01, Unchanged));
  }
}

TEST(SignalFaults, AreNotSamplesThatAreRepeated) {
  // A logger that is five times as fast as its sensor.
  std::mt19937_64 generator(7);
  std::normal_distribution<double> normal(0, 1);
  SignalFaults faults;
  double value = 0;
  for (int k = 0; k < kSamples; ++k) {
    if (k % 5 == 0) value = std::round(20 * normal(generator)) / 10;
    faults.Add(value);
  }
  ExpectNone(faults);
}

TEST(SignalFaults, DoNotReachOverRuns) {
  SignalFaults faults;
  for (int run = 0; run < 10; ++run) {
    for (int k = 0; k < 20; ++k) faults.Add(5 + 0.01 * ((k * 7) % 10));
    faults.Add(0);  // the last sample of each
    faults.EndRun();
  }
  EXPECT_EQ(faults.Dropouts().count, 0);
}

}  // namespace
}  // namespace polyest::internal
