#pragma once

// Defines an axis of a plot: a range with round ticks, and the map from values to pixels.

#include <string>
#include <vector>

namespace polyest::internal {

struct AxisTick {
  double value = 0;
  std::string text;
};

struct Axis {
  double lower = 0;
  double upper = 1;
  double first_pixel = 0;  // pixel of `lower`
  double last_pixel = 1;   // pixel of `upper`
  std::vector<AxisTick> ticks;
  int exponent = 0;  // the ticks' texts are to be multiplied by 10^exponent

  double Pixel(double value) const {
    return first_pixel + (value - lower) / (upper - lower) * (last_pixel - first_pixel);
  }
};

// Returns an axis over [lower, upper] with about `count` ticks at multiples of 1, 2 or 5 · 10^n. An
// empty range is widened around its value. A range that is not finite, or whose length is not from
// 1e-300 to 1e300, becomes [0, 1].
Axis MakeAxis(double lower, double upper, int count, double first_pixel, double last_pixel);

// Returns 10^exponent with raised digits, as in "×10⁻³".
std::string PowerOfTenText(int exponent);

}  // namespace polyest::internal
