#pragma once

// Smooth curves through the knots (t_k, u_k) of a sampled signal, cubic on each interval:
//
//   u(t) = (1 + 2q)(1 − q)² u_k + q² (3 − 2q) u_{k+1} + h q (1 − q)² s_k − h q² (1 − q) s_{k+1},
//   q = (t − t_k)/h,  h = t_{k+1} − t_k,
//
// Each knot has a slope s_k, which makes u and its derivative continuous. A slope depends on a few
// neighbouring knots only, so a distant knot, or one yet to come, does not change it.

#include <cstddef>
#include <span>

#include "polyest/input_signal.h"

namespace polyest::internal {

// The slopes are SplineSlope for kCubic and MonotoneSlope for kShapePreserving.

// Returns the largest number of later knots that the slope at a knot may depend on: 3 for kCubic, 2
// for kShapePreserving (reached at the first knot), else 0.
int KnotsAhead(Interpolation interpolation);

// Returns the slope at knot k of the cubic spline through it and up to kSplineReach knots on either
// side. At the ends of this stretch the third derivative is continuous (not-a-knot). The slope is
// exact for cubics from four knots on. The influence of a knot on a spline decays by the factor 2 −
// √3 ≈ 0.27 per knot, so knots farther away matter little.
inline constexpr int kSplineReach = 3;
// Number of knots up to a time that the curve from there on may depend on: the two of its interval,
// and those that slopes yet to come depend on.
inline constexpr int kKnotsBehind = 2 * kSplineReach + 2;
double SplineSlope(std::span<const double> time_s, std::span<const double> value, size_t k);

// Returns the slope of Fritsch and Butland: 0 where the chords on either side differ in sign, else
// their weighted harmonic mean; at the ends the three-point formula, limited. The curve never
// overshoots the knots. Source: Fritsch & Butland, SIAM J. Sci. Stat. Comput. 5 (1984) 300.
double MonotoneSlope(std::span<const double> time_s, std::span<const double> value, size_t k);

// Returns u(at_s) for at_s between the knots k and k + 1, with the given slopes at these knots.
inline double Hermite(std::span<const double> time_s, std::span<const double> value, size_t k,
                      double left_slope, double right_slope, double at_s) {
  const double h = time_s[k + 1] - time_s[k];
  const double q = (at_s - time_s[k]) / h;
  const double p = 1 - q;
  return (1 + 2 * q) * p * p * value[k] + q * q * (3 - 2 * q) * value[k + 1] +
         h * q * p * (p * left_slope - q * right_slope);
}

}  // namespace polyest::internal
