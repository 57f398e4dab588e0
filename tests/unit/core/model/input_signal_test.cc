#include "core/model/input_signal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>
#include "core/common/check.h"

namespace polyest::internal {
namespace {

using ::testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kPi = std::numbers::pi;
// The bound is a few roundings of sin's argument, which stays below 100 here.
constexpr double kRounding = 1e-13;

InputSignal Make(InputSpecification specification) {
  return InputSignal::Make(std::move(specification)).value();
}

std::string Refusal(InputSpecification specification) {
  const absl::Status status = InputSignal::Make(std::move(specification)).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  return std::string(status.message());
}

double FromTheLeft(const InputSignal& signal, double time_s) {
  return signal.Shape(std::nextafter(time_s, -kInfinity));
}

// Returns every break of the signal after the given time.
std::vector<double> Breaks(const InputSignal& signal, double time_s) {
  std::vector<double> breaks;
  while ((time_s = signal.NextBreak(time_s)) < kInfinity) breaks.push_back(time_s);
  return breaks;
}

TEST(ConstantInput, IsOneForever) {
  const InputSignal signal = Make(ConstantInput{.amplitude = 3});
  EXPECT_EQ(signal.default_amplitude(), 3);
  EXPECT_EQ(signal.Shape(-1), 1);
  EXPECT_EQ(signal.Shape(1e9), 1);
  EXPECT_EQ(signal.NextBreak(0), kInfinity);
  EXPECT_FALSE(signal.Jumps());
  EXPECT_FALSE(signal.streamed());
}

TEST(StepInput, JumpsAtItsTime) {
  const InputSignal signal = Make(StepInput{.amplitude = 2, .time_s = 1.5});
  EXPECT_EQ(signal.default_amplitude(), 2);
  EXPECT_EQ(FromTheLeft(signal, 1.5), 0);
  EXPECT_EQ(signal.Shape(1.5), 1);
  EXPECT_EQ(signal.NextBreak(1.0), 1.5);
  EXPECT_EQ(signal.NextBreak(1.5), kInfinity);
  EXPECT_TRUE(signal.Jumps());
}

TEST(SinusoidInput, TurnsOncePerPeriod) {
  const InputSignal signal =
      Make(SinusoidInput{.amplitude = 4, .frequency_hz = 0.5, .phase_rad = kPi / 6});
  EXPECT_EQ(signal.default_amplitude(), 4);
  EXPECT_NEAR(signal.Shape(0), 0.5, kRounding);
  EXPECT_NEAR(signal.Shape(2.0 / 3), std::sin(kPi * 5 / 6), kRounding);
  EXPECT_NEAR(signal.Shape(1), -0.5, kRounding);
  EXPECT_NEAR(signal.Shape(2), 0.5, kRounding);
  EXPECT_EQ(signal.NextBreak(0), kInfinity);
  EXPECT_FALSE(signal.Jumps());
}

TEST(ChirpInput, SweepsBetweenItsFrequencies) {
  const InputSignal signal = Make(ChirpInput{.amplitude = 1,
                                             .start_frequency_hz = 1,
                                             .end_frequency_hz = 3,
                                             .start_s = 2,
                                             .duration_s = 4,
                                             .phase_rad = 0.3});
  // The instantaneous frequency is 1 + (3 − 1) τ/4 Hz; its integral over 0 … τ is τ + τ²/4 cycles.
  for (const double tau : {0.0, 0.5, 1.0, 3.9}) {
    EXPECT_NEAR(signal.Shape(2 + tau), std::sin(2 * kPi * (tau + tau * tau / 4) + 0.3), kRounding);
  }
}

TEST(ChirpInput, IsZeroOutsideAndJumpsAtItsEnds) {
  const InputSignal signal = Make(ChirpInput{.start_frequency_hz = 0,
                                             .end_frequency_hz = 1,
                                             .start_s = 1,
                                             .duration_s = 2,
                                             .phase_rad = kPi / 2});
  EXPECT_EQ(FromTheLeft(signal, 1), 0);
  EXPECT_NEAR(signal.Shape(1), 1, kRounding);
  EXPECT_NEAR(FromTheLeft(signal, 3), 1, kRounding);  // one cycle later
  EXPECT_EQ(signal.Shape(3), 0);
  EXPECT_EQ(Breaks(signal, -5), (std::vector<double>{1, 3}));
  EXPECT_TRUE(signal.Jumps());
}

TEST(HalfSineBumpInput, RisesToOneAndReturns) {
  const InputSignal signal =
      Make(HalfSineBumpInput{.amplitude = 0.05, .start_s = 0.5, .duration_s = 0.2});
  EXPECT_EQ(signal.default_amplitude(), 0.05);
  EXPECT_EQ(signal.Shape(0.4), 0);
  EXPECT_EQ(signal.Shape(0.5), 0);
  EXPECT_NEAR(signal.Shape(0.55), std::sqrt(0.5), kRounding);
  EXPECT_NEAR(signal.Shape(0.6), 1, kRounding);
  EXPECT_NEAR(FromTheLeft(signal, 0.7), 0, kRounding);
  EXPECT_EQ(signal.Shape(0.7), 0);
  EXPECT_EQ(Breaks(signal, 0), (std::vector<double>{0.5, 0.7}));
  EXPECT_EQ(signal.NextBreak(0.5), 0.7);
  EXPECT_FALSE(signal.Jumps());
}

TEST(TableInput, IsLinearBetweenItsKnotsAndConstantOutside) {
  const InputSignal signal =
      Make(TableInput{.time_s = {1, 2, 4}, .value = {10, 20, -20}, .amplitude = 0.5});
  EXPECT_EQ(signal.default_amplitude(), 0.5);
  EXPECT_EQ(signal.Shape(0), 10);
  EXPECT_EQ(signal.Shape(1), 10);
  EXPECT_EQ(signal.Shape(1.25), 12.5);
  EXPECT_EQ(signal.Shape(2), 20);
  EXPECT_EQ(signal.Shape(3), 0);
  EXPECT_EQ(signal.Shape(4), -20);
  EXPECT_EQ(signal.Shape(99), -20);
  EXPECT_EQ(Breaks(signal, 0), (std::vector<double>{1, 2, 4}));
  EXPECT_EQ(Breaks(signal, 1), (std::vector<double>{2, 4}));
  EXPECT_FALSE(signal.Jumps());
}

TEST(TableInput, HoldsEachValueUntilTheNextKnot) {
  const InputSignal signal = Make(TableInput{
      .time_s = {1, 2, 4}, .value = {10, 20, -20}, .interpolation = Interpolation::kHold});
  EXPECT_EQ(signal.default_amplitude(), 1);
  EXPECT_EQ(signal.Shape(0), 10);
  EXPECT_EQ(FromTheLeft(signal, 2), 10);
  EXPECT_EQ(signal.Shape(2), 20);
  EXPECT_EQ(signal.Shape(3.9), 20);
  EXPECT_EQ(signal.Shape(4), -20);
  EXPECT_EQ(signal.Shape(99), -20);
  EXPECT_EQ(Breaks(signal, 0), (std::vector<double>{1, 2, 4}));
  EXPECT_TRUE(signal.Jumps());
}

TEST(TableInput, OfOneKnotIsConstant) {
  const InputSignal signal = Make(TableInput{.time_s = {1}, .value = {7}});
  EXPECT_EQ(signal.Shape(0), 7);
  EXPECT_EQ(signal.Shape(1), 7);
  EXPECT_EQ(signal.Shape(2), 7);
}

TEST(StreamedInput, FollowsTheKnotsAppended) {
  InputSignal signal = Make(StreamedInput{.interpolation = Interpolation::kLinear});
  EXPECT_TRUE(signal.streamed());
  EXPECT_EQ(signal.default_amplitude(), 1);
  EXPECT_EQ(signal.Shape(0), 0);
  EXPECT_EQ(signal.NextBreak(0), kInfinity);

  signal.Append(0, 5);
  EXPECT_EQ(signal.Shape(-1), 5);
  EXPECT_EQ(signal.Shape(3), 5);  // The last value holds until more is known.

  signal.Append(2, 9);
  EXPECT_EQ(signal.Shape(0.5), 6);
  EXPECT_EQ(signal.Shape(3), 9);
  EXPECT_EQ(Breaks(signal, -1), (std::vector<double>{0, 2}));
  EXPECT_FALSE(signal.Jumps());
}

TEST(StreamedInput, HoldsWhenAsked) {
  InputSignal signal = Make(StreamedInput{.interpolation = Interpolation::kHold, .amplitude = 2});
  signal.Append(0, 5);
  signal.Append(2, 9);
  EXPECT_EQ(signal.default_amplitude(), 2);
  EXPECT_EQ(FromTheLeft(signal, 2), 5);
  EXPECT_EQ(signal.Shape(2), 9);
  EXPECT_TRUE(signal.Jumps());
}

TEST(StreamedInput, BeginsANewRunWhenCleared) {
  InputSignal signal = Make(StreamedInput{.interpolation = Interpolation::kLinear});
  signal.Append(0, 5);
  signal.Append(2, 9);
  signal.Clear();
  EXPECT_EQ(signal.Shape(1), 0);
  signal.Append(1, 3);  // earlier than the last knot of the previous run
  EXPECT_EQ(signal.Shape(0), 3);
  EXPECT_EQ(Breaks(signal, 0), (std::vector<double>{1}));
}

TEST(StreamedInput, IsTheSameAfterForgettingKnots) {
  for (const Interpolation interpolation :
       {Interpolation::kLinear, Interpolation::kHold, Interpolation::kCubic,
        Interpolation::kShapePreserving}) {
    StreamedInput input;
    input.interpolation = interpolation;
    InputSignal all = InputSignal::Make(input).value(), bounded = all;
    size_t most = 0;
    for (int k = 0; k < 20'000; ++k) {
      const double time_s = 0.1 * k, value = std::sin(0.7 * k) + 0.01 * (k % 7);
      all.Append(time_s, value);
      bounded.Append(time_s, value);
      if (k % 50 != 49) continue;
      const double now_s = time_s - 0.53;  // four knots ahead are more than any curve needs
      bounded.Forget(now_s);
      most = std::max(most, bounded.knot_times_s().size());
      ASSERT_EQ(bounded.Shape(now_s), all.Shape(now_s));
      ASSERT_EQ(bounded.Shape(now_s + 0.07), all.Shape(now_s + 0.07));
      ASSERT_EQ(bounded.NextBreak(now_s), all.NextBreak(now_s));
      ASSERT_EQ(bounded.NextKnot(now_s), all.NextKnot(now_s));
      ASSERT_EQ(bounded.SettledUpTo(now_s), all.SettledUpTo(now_s));
    }
    EXPECT_LT(most, 2'500);
  }
}

TEST(StreamedInputCheck, TakesOnlyFiniteKnotsInIncreasingTime) {
  InputSignal signal = Make(StreamedInput{.interpolation = Interpolation::kLinear});
  signal.Append(1, 0);
  EXPECT_THROW(signal.Append(1, 0), CheckFailure);
  EXPECT_THROW(signal.Append(2, kNan), CheckFailure);
  EXPECT_THROW(Make(ConstantInput{}).Append(1, 0), CheckFailure);
  EXPECT_THROW(Make(ConstantInput{}).Clear(), CheckFailure);
}

TEST(InputSignal, NamesTheFieldTheValueAndTheRule) {
  EXPECT_EQ(Refusal(SinusoidInput{.frequency_hz = 0}),
            "sinusoid.frequency_hz: 0 must be finite and above 0");
  EXPECT_EQ(Refusal(TableInput{.time_s = {0, 1}, .value = {2}}),
            "table.time_s: 2 times for 1 values; they must be equally many");
  EXPECT_EQ(Refusal(TableInput{}), "table.time_s: there must be at least one");
  EXPECT_EQ(Refusal(TableInput{.time_s = {0, 3, 3}, .value = {0, 0, 0}}),
            "table.time_s[2]: 3 must be above the time before, 3");
}

TEST(InputSignal, RefusesNumbersThatAreNotFinite) {
  EXPECT_THAT(Refusal(ConstantInput{.amplitude = kNan}), HasSubstr("constant.amplitude: "));
  EXPECT_THAT(Refusal(StepInput{.amplitude = kInfinity}), HasSubstr("step.amplitude: "));
  EXPECT_THAT(Refusal(StepInput{.time_s = kNan}), HasSubstr("step.time_s: "));
  EXPECT_THAT(Refusal(SinusoidInput{.amplitude = kNan}), HasSubstr("sinusoid.amplitude: "));
  EXPECT_THAT(Refusal(SinusoidInput{.frequency_hz = kInfinity}), HasSubstr("frequency_hz"));
  EXPECT_THAT(Refusal(SinusoidInput{.phase_rad = kNan}), HasSubstr("phase_rad"));
  EXPECT_THAT(Refusal(ChirpInput{.amplitude = kNan}), HasSubstr("chirp.amplitude: "));
  EXPECT_THAT(Refusal(ChirpInput{.start_s = kNan}), HasSubstr("start_s"));
  EXPECT_THAT(Refusal(ChirpInput{.phase_rad = kNan}), HasSubstr("phase_rad"));
  EXPECT_THAT(Refusal(HalfSineBumpInput{.amplitude = kNan}),
              HasSubstr("half_sine_bump.amplitude: "));
  EXPECT_THAT(Refusal(HalfSineBumpInput{.start_s = kNan}), HasSubstr("start_s"));
  EXPECT_THAT(Refusal(TableInput{.time_s = {kNan}, .value = {0}}), HasSubstr("table.time_s[0]: "));
  EXPECT_THAT(Refusal(TableInput{.time_s = {0}, .value = {kNan}}), HasSubstr("value[0]"));
  EXPECT_THAT(Refusal(TableInput{.time_s = {0}, .value = {0}, .amplitude = kNan}),
              HasSubstr("table.amplitude: "));
  EXPECT_THAT(Refusal(StreamedInput{.amplitude = kNan}), HasSubstr("streamed.amplitude: "));
}

TEST(InputSignal, RefusesFrequenciesAndDurationsWithoutMeaning) {
  EXPECT_THAT(Refusal(SinusoidInput{.frequency_hz = -1}), HasSubstr("frequency_hz: -1"));
  EXPECT_THAT(Refusal(ChirpInput{.start_frequency_hz = -1}), HasSubstr("start_frequency_hz: -1"));
  EXPECT_THAT(Refusal(ChirpInput{.end_frequency_hz = -2}), HasSubstr("end_frequency_hz: -2"));
  EXPECT_THAT(Refusal(ChirpInput{.duration_s = 0}), HasSubstr("duration_s: 0"));
  EXPECT_THAT(Refusal(HalfSineBumpInput{.duration_s = -0.5}), HasSubstr("duration_s: -0.5"));
}

}  // namespace
}  // namespace polyest::internal
