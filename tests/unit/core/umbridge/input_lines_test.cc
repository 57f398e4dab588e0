// Tests the straight lines by which servers find inputs. The oracle is the signal itself.

#include "core/umbridge/input_lines.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace polyest::internal {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

InputSignal Signal(InputSpecification specification) {
  return InputSignal::Make(std::move(specification)).value();
}

double Between(const InputLines& lines, double time_s) {
  const auto right = std::ranges::upper_bound(lines.times_s, time_s);
  if (right == lines.times_s.end()) return lines.values.back();
  const auto i = static_cast<size_t>(right - lines.times_s.begin());
  return std::lerp(lines.values[i - 1], lines.values[i],
                   (time_s - lines.times_s[i - 1]) / (lines.times_s[i] - lines.times_s[i - 1]));
}

double LargestError(const InputSignal& signal, double delay_s, double end_s) {
  const InputLines lines = LinesOf(signal, delay_s, end_s).value();
  double largest = 0;
  for (int i = 0; i < 5000; ++i) {
    const double time_s = end_s * i / 5000;
    largest = std::max(largest, std::abs(Between(lines, time_s) - signal.Shape(time_s - delay_s)));
  }
  return largest;
}

TEST(InputLines, PassThroughTheKnotsOfALinearTable) {
  const InputSignal signal = Signal(TableInput{.time_s = {0.5, 1, 3}, .value = {2, 4, 0}});
  const InputLines lines = LinesOf(signal, 0, 2).value();
  EXPECT_THAT(lines.times_s, ElementsAre(0, 0.5, 1, 2));
  EXPECT_THAT(lines.values, ElementsAre(2, 2, 4, 2));
}

TEST(InputLines, AreShiftedByTheDelay) {
  const InputSignal signal = Signal(TableInput{.time_s = {0.5, 1, 3}, .value = {2, 4, 0}});
  const InputLines late = LinesOf(signal, 0.25, 2).value();
  EXPECT_THAT(late.times_s, ElementsAre(0, 0.75, 1.25, 2));
  EXPECT_THAT(late.values, ElementsAre(2, 2, 4, 2.5));
  const InputLines early = LinesOf(signal, -0.75, 2).value();
  EXPECT_THAT(early.times_s, ElementsAre(0, 0.25, 2));
  EXPECT_THAT(early.values, ElementsAre(3, 4, 0.5));
}

TEST(InputLines, HaveTwoValuesWhereAnInputJumps) {
  const InputLines step = LinesOf(Signal(StepInput{.time_s = 1}), 0, 2).value();
  EXPECT_THAT(step.times_s, ElementsAre(0, 1, 1, 2));
  EXPECT_THAT(step.values, ElementsAre(0, 0, 1, 1));
  InputSignal held = Signal(StreamedInput{.interpolation = Interpolation::kHold});
  held.Append(0, 3);
  held.Append(1, 5);
  const InputLines lines = LinesOf(held, 0, 1.5).value();
  EXPECT_THAT(lines.times_s, ElementsAre(0, 1, 1, 1.5));
  EXPECT_THAT(lines.values, ElementsAre(3, 3, 5, 5));
}

TEST(InputLines, OfNoTimeAreOnePoint) {
  const InputLines lines = LinesOf(Signal(ConstantInput{}), 0, 0).value();
  EXPECT_THAT(lines.times_s, ElementsAre(0));
  EXPECT_THAT(lines.values, ElementsAre(1));
}

// A line as long as h under a sine of the angular frequency ω deviates by at most (ω h)²/8, here
// (2π/200)²/8 = 1.23e-4; the last line is up to a hundredth longer.
TEST(InputLines, FollowSines) {
  EXPECT_LT(LargestError(Signal(SinusoidInput{.frequency_hz = 3, .phase_rad = 1}), 0.1, 2), 1.3e-4);
  EXPECT_LT(LargestError(Signal(HalfSineBumpInput{.start_s = 0.5, .duration_s = 0.3}), 0.1, 2),
            1.3e-4);
  const ChirpInput chirp{.start_frequency_hz = 8,
                         .end_frequency_hz = 1,
                         .start_s = 0.25,
                         .duration_s = 1,
                         .phase_rad = 2};
  EXPECT_LT(LargestError(Signal(chirp), 0, 2), 1.3e-4);
}

// Between two knots h apart a tenth of the distance deviates by at most h²/800 · max |u″|, for the
// slopes here of sin t: h = 0.5, |u″| ≤ 1.3 on such a spline.
TEST(InputLines, FollowSmoothCurves) {
  InputSignal signal = Signal(StreamedInput{});
  for (int k = 0; k <= 20; ++k) signal.Append(0.5 * k, std::sin(0.5 * k));
  signal.Finish();
  EXPECT_LT(LargestError(signal, 0.3, 11), 0.25 * 1.3 / 800);
}

TEST(InputLines, KeepTheirBeginningAsTimeGoesOn) {
  const InputSignal signal = Signal(SinusoidInput{.frequency_hz = 3});
  const InputLines one = LinesOf(signal, 0, 1.0001).value();
  const InputLines two = LinesOf(signal, 0, 2.0001).value();
  ASSERT_GT(two.times_s.size(), one.times_s.size());
  for (size_t i = 0; i + 1 < one.times_s.size(); ++i) {
    EXPECT_EQ(one.times_s[i], two.times_s[i]);
    EXPECT_EQ(one.values[i], two.values[i]);
  }
}

TEST(InputLines, AreNotWithoutNumber) {
  const absl::Status status = LinesOf(Signal(SinusoidInput{.frequency_hz = 1e6}), 0, 10).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(status.message()), HasSubstr("more than 1e+06 lines"));
}

}  // namespace
}  // namespace polyest::internal
