#include "core/propagation/noise_parts.h"

#include <algorithm>
#include <cmath>

namespace polyest::internal {
namespace {

// The least part of an interval, so that its ends differ in spite of rounding.
constexpr double kMinPart = 1e-9;

void DivideEvenly(double start_s, double end_s, int parts, std::vector<double>& ends_s) {
  for (int part = 1; part < parts; ++part) {
    ends_s.push_back(start_s + (end_s - start_s) * part / parts);
  }
  ends_s.push_back(end_s);
}

}  // namespace

void DivideForNoise(double start_s, double end_s, double rate, std::vector<double>& ends_s) {
  ends_s.clear();
  const double interval_s = end_s - start_s;
  const double parts = std::ceil(interval_s * rate);
  if (!std::isfinite(parts)) return DivideEvenly(start_s, end_s, kMaxEvenParts, ends_s);
  if (parts <= kMaxEvenParts) {
    return DivideEvenly(start_s, end_s, std::max(1, static_cast<int>(parts)), ends_s);
  }
  const double shortest_s = std::max(1 / rate, kMinPart * interval_s);
  for (double left_s = 0; left_s < interval_s;) {
    ends_s.push_back(end_s - left_s);
    left_s += std::max(shortest_s, left_s / kMaxEvenParts);
  }
  std::ranges::reverse(ends_s);
}

}  // namespace polyest::internal
