#include "client/plot/svg_axis.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace polyest::internal {
namespace {

constexpr double kMinRange = 1e-9;  // of the largest value
// Beyond these, powers of ten of a step or of a unit are not numbers any more.
constexpr double kShortest = 1e-300;
constexpr double kLongest = 1e300;

// Returns the least of 1, 2, 5 · 10^n that is at least `step`.
double RoundStep(double step) {
  const double power = std::pow(10.0, std::floor(std::log10(step)));
  for (double factor : {1.0, 2.0, 5.0}) {
    if (factor * power >= step * (1 - 1e-9)) return factor * power;
  }
  return 10 * power;
}

}  // namespace

Axis MakeAxis(double lower, double upper, int count, double first_pixel, double last_pixel) {
  // Rounding errors of a constant are no range; ticks so close could not be told apart.
  if (!(upper - lower > kMinRange * std::max(std::abs(lower), std::abs(upper)))) {
    const double middle = 0.5 * (lower + upper);
    const double half = middle == 0 ? 0.5 : std::abs(middle) / 2;
    lower = middle - half;
    upper = middle + half;
  }
  if (!(upper - lower >= kShortest && upper - lower <= kLongest)) {
    lower = 0;
    upper = 1;
  }
  Axis axis{lower, upper, first_pixel, last_pixel, {}, 0};
  const double step = RoundStep((upper - lower) / count);
  const double largest = std::max(std::abs(lower), std::abs(upper));
  const int magnitude = static_cast<int>(std::floor(std::log10(largest)));
  if (magnitude < -2 || magnitude > 4) axis.exponent = magnitude;
  const double unit = std::pow(10.0, axis.exponent);
  const int decimals =
      std::max(0, -static_cast<int>(std::floor(std::log10(step / unit * (1 + 1e-9)))));
  const double slack = 1e-9 * step;
  for (double k = std::ceil((lower - slack) / step); k * step <= upper + slack; ++k) {
    const double value = k * step;
    const double shown = value == 0 ? 0.0 : value / unit;
    // U+2212, the minus sign that is as wide as a plus.
    axis.ticks.push_back({value, absl::StrCat(shown < 0 ? "−" : "",
                                              absl::StrFormat("%.*f", decimals, std::abs(shown)))});
  }
  return axis;
}

std::string PowerOfTenText(int exponent) {
  static constexpr const char* kRaised[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = exponent < 0 ? "×10⁻" : "×10";
  for (char digit : std::to_string(std::abs(exponent))) text += kRaised[digit - '0'];
  return text;
}

}  // namespace polyest::internal
