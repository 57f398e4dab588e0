#include "core/umbridge/input_lines.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <type_traits>
#include <variant>

#include "core/common/types.h"

namespace polyest::internal {
namespace {

constexpr double kLinesBetweenKnots = 10;
constexpr double kLinesInPeriod = 200;
constexpr double kMaxLines = 1e6;
constexpr double kLonger = 0.01;  // of a piece's last line

bool IsSmooth(Interpolation interpolation) {
  return interpolation == Interpolation::kCubic || interpolation == Interpolation::kShapePreserving;
}

// Returns the longest line on a piece between two knots or breaks.
double LongestLine(const InputSpecification& specification, double begin_s, double end_s) {
  return std::visit(
      [&]<class Input>(const Input& input) {
        if constexpr (std::is_same_v<Input, SinusoidInput>) {
          return 1 / (kLinesInPeriod * input.frequency_hz);
        } else if constexpr (std::is_same_v<Input, ChirpInput>) {
          const bool sweeps =
              begin_s >= input.start_s && begin_s < input.start_s + input.duration_s;
          const double fastest_hz = std::max(input.start_frequency_hz, input.end_frequency_hz);
          return sweeps ? 1 / (kLinesInPeriod * fastest_hz) : kInfinity;
        } else if constexpr (std::is_same_v<Input, HalfSineBumpInput>) {
          const bool rises = begin_s >= input.start_s && begin_s < input.start_s + input.duration_s;
          return rises ? 2 * input.duration_s / kLinesInPeriod : kInfinity;
        } else if constexpr (std::is_same_v<Input, TableInput> ||
                             std::is_same_v<Input, StreamedInput>) {
          return IsSmooth(input.interpolation) ? (end_s - begin_s) / kLinesBetweenKnots : kInfinity;
        } else {
          return kInfinity;
        }
      },
      specification);
}

}  // namespace

absl::StatusOr<InputLines> LinesOf(const InputSignal& signal, double delay_s, double end_s) {
  InputLines lines;
  const auto add = [&](double time_s) {
    lines.times_s.push_back(std::clamp(time_s + delay_s, 0.0, end_s));
    lines.values.push_back(signal.Shape(time_s));
  };
  // From here on in the signal's own time.
  const double last_s = end_s - delay_s;
  double begin_s = -delay_s;
  add(begin_s);
  while (begin_s < last_s) {
    const double knot_s = signal.NextKnot(begin_s);
    const double to_s = std::min(knot_s, last_s);
    const double line_s = LongestLine(signal.specification(), begin_s, knot_s);
    if (static_cast<double>(lines.times_s.size()) + (to_s - begin_s) / line_s > kMaxLines) {
      return absl::FailedPreconditionError(absl::StrFormat(
          "more than %g lines would have to stand for it up to t = %g s", kMaxLines, end_s));
    }
    // The last line of a piece may be a bit longer, so that rounding leaves no tiny one.
    for (int i = 1; begin_s + (i + kLonger) * line_s < to_s; ++i) add(begin_s + i * line_s);
    if (to_s == knot_s && signal.Jumps()) {
      add(std::nextafter(to_s, -kInfinity));
      lines.times_s.back() = std::min(knot_s + delay_s, end_s);
    }
    add(to_s);
    begin_s = to_s;
  }
  return lines;
}

}  // namespace polyest::internal
