#pragma once

// Smooth curves through the knots (t_k, u_k) of a sampled signal: a cubic on each interval,
//
//   u(t) = (1 + 2q)(1 − q)² u_k + q² (3 − 2q) u_{k+1} + h q (1 − q)² s_k − h q² (1 − q) s_{k+1},
//   q = (t − t_k)/h,  h = t_{k+1} − t_k,
//
// with a slope s_k for each knot, so that u and its derivative are continuous. Slopes depend on a
// few neighbours only: a knot far away, or yet to come, changes nothing.

#include <cstddef>
#include <span>

#include "polyest/input_signal.h"

namespace polyest::internal {

// Slopes are SplineSlope for kCubic and MonotoneSlope for kShapePreserving.

// Returns the number of knots after a knot that its slope may depend on: 3 for kCubic; 2 for
// kShapePreserving, at its first knot; else 0.
int KnotsAhead(Interpolation interpolation);

// The slope at knot k of the cubic spline through it and the kSplineReach knots on either side, as
// far as there are any; at the ends of this stretch the third derivative is continuous
// (not-a-knot). Exact on cubics from four knots on. What knots farther away would change, a spline
// forgets by (2 − √3) ≈ 0.27 a knot.
inline constexpr int kSplineReach = 3;
double SplineSlope(std::span<const double> time_s, std::span<const double> value, size_t k);

// The slope of Fritsch and Butland: 0 where the chords on either side differ in sign, else their
// harmonic mean, weighted; at the ends the three-point formula, limited. Never overshoots the
// knots. (Fritsch & Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300.)
double MonotoneSlope(std::span<const double> time_s, std::span<const double> value, size_t k);

// u(t) on the interval from knot k to knot k + 1 with these slopes at its ends.
double Hermite(std::span<const double> time_s, std::span<const double> value, size_t k,
               double left_slope, double right_slope, double at_s);

}  // namespace polyest::internal
