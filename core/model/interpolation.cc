#include "core/model/interpolation.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/common/check.h"

namespace polyest::internal {
namespace {

constexpr size_t kMaxKnots = 2 * kSplineReach + 1;

// A stretch of knots with the widths h_i = t_{i+1} − t_i of its intervals and the slopes δ_i =
// (u_{i+1} − u_i)/h_i of its chords.
struct Stretch {
  size_t knots;
  std::array<double, kMaxKnots> width;
  std::array<double, kMaxKnots> chord;
};

Stretch StretchOf(std::span<const double> time_s, std::span<const double> value) {
  Stretch stretch{.knots = time_s.size(), .width = {}, .chord = {}};
  for (size_t i = 0; i + 1 < time_s.size(); ++i) {
    stretch.width[i] = time_s[i + 1] - time_s[i];
    stretch.chord[i] = (value[i + 1] - value[i]) / stretch.width[i];
  }
  return stretch;
}

// Returns the slope at knot k of the parabola through three knots.
double ParabolaSlope(const Stretch& stretch, size_t k) {
  const auto& h = stretch.width;
  const auto& chord = stretch.chord;
  const double curvature = (chord[1] - chord[0]) / (h[0] + h[1]);
  if (k == 0) return chord[0] - curvature * h[0];
  return k == 1 ? chord[0] + curvature * h[0] : chord[1] + curvature * h[1];
}

// One row of the tridiagonal system for the slopes: below · s_{i−1} + diagonal · s_i + above ·
// s_{i+1} = right.
struct Row {
  double below = 0, diagonal = 0, above = 0, right = 0;
};

Row SplineRow(const Stretch& stretch, size_t i) {
  const auto& h = stretch.width;
  const auto& chord = stretch.chord;
  const size_t last = stretch.knots - 1;
  if (i == 0) {
    const double both = h[0] + h[1];
    return {0, h[1], both, ((h[0] + 2 * both) * h[1] * chord[0] + h[0] * h[0] * chord[1]) / both};
  }
  const double l = h[i - 1];
  if (i == last) {
    const double before = h[i - 2];
    const double both = before + l;
    return {both, before, 0,
            (l * l * chord[i - 2] + (2 * both + l) * before * chord[i - 1]) / both};
  }
  const double r = h[i];
  return {r, 2 * (l + r), l, 3 * (r * chord[i - 1] + l * chord[i])};
}

double SlopeOfSpline(const Stretch& stretch, size_t k) {
  std::array<Row, kMaxKnots> rows;
  for (size_t i = 0; i < stretch.knots; ++i) {
    rows[i] = SplineRow(stretch, i);
    if (i == 0) continue;
    const double factor = rows[i].below / rows[i - 1].diagonal;
    rows[i].diagonal -= factor * rows[i - 1].above;
    rows[i].right -= factor * rows[i - 1].right;
  }
  double slope = 0;
  for (size_t i = stretch.knots; i-- > k;) {
    slope = (rows[i].right - rows[i].above * slope) / rows[i].diagonal;
  }
  return slope;
}

// Returns the slope at an end by the three-point formula: 0 if its sign differs from the chord's,
// and at most three times the chord's slope if the chords differ in sign.
double LimitedEndSlope(double h0, double h1, double chord0, double chord1) {
  const double slope = ((2 * h0 + h1) * chord0 - h0 * chord1) / (h0 + h1);
  if (slope * chord0 <= 0) return 0;
  if (chord0 * chord1 <= 0 && std::abs(slope) > 3 * std::abs(chord0)) return 3 * chord0;
  return slope;
}

}  // namespace

int KnotsAhead(Interpolation interpolation) {
  switch (interpolation) {
    case Interpolation::kHold:
    case Interpolation::kLinear:
      return 0;
    case Interpolation::kCubic:
      return kSplineReach;
    case Interpolation::kShapePreserving:
      return 2;
  }
  POLYEST_CHECK(false);
}

double SplineSlope(std::span<const double> time_s, std::span<const double> value, size_t k) {
  const size_t first = k - std::min<size_t>(k, kSplineReach);
  const size_t count = std::min(time_s.size(), k + kSplineReach + 1) - first;
  const Stretch stretch = StretchOf(time_s.subspan(first, count), value.subspan(first, count));
  switch (count) {
    case 1:
      return 0;
    case 2:
      return stretch.chord[0];
    case 3:
      return ParabolaSlope(stretch, k - first);
    default:
      return SlopeOfSpline(stretch, k - first);
  }
}

double MonotoneSlope(std::span<const double> time_s, std::span<const double> value, size_t k) {
  const size_t first = k - std::min<size_t>(k, 1);
  if (time_s.size() < 2) return 0;
  const bool at_end = k == 0 || k + 1 == time_s.size();
  const size_t begin = !at_end || k == 0 ? first : k - std::min<size_t>(k, 2);
  const size_t count = std::min<size_t>(3, time_s.size() - begin);
  const Stretch stretch = StretchOf(time_s.subspan(begin, count), value.subspan(begin, count));
  const auto& h = stretch.width;
  const auto& chord = stretch.chord;
  if (count == 2) return chord[0];
  if (k == 0) return LimitedEndSlope(h[0], h[1], chord[0], chord[1]);
  if (at_end) return LimitedEndSlope(h[1], h[0], chord[1], chord[0]);
  if (chord[0] * chord[1] <= 0) return 0;
  // (w_l + w_r)/s = w_l/δ_l + w_r/δ_r,  w_l = 2 h_r + h_l,  w_r = h_r + 2 h_l
  const double left = 2 * h[1] + h[0];
  const double right = h[1] + 2 * h[0];
  return (left + right) / (left / chord[0] + right / chord[1]);
}

}  // namespace polyest::internal
