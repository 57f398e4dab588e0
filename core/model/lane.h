#pragma once

// The scalar type in which a model's equations are evaluated, and replacements for those of Eigen's
// functions that do not suit it.

#include <cmath>
#include <limits>

#include "core/common/types.h"

namespace polyest::internal {

// The values of one quantity at kLanes points.
using Lane = Eigen::Array<double, kLanes, 1>;

inline double Sqrt(double x) { return std::sqrt(x); }

// Returns the correctly rounded root, identical to that of a single point. Eigen's own square root
// is an approximation refined by Newton steps on processors with AVX-512.
inline Lane Sqrt(const Lane& x) {
  Lane root;
  for (int i = 0; i < kLanes; ++i) root[i] = std::sqrt(x[i]);
  return root;
}

inline double Tanh(double x) { return std::tanh(x); }

// Returns tanh x = 1 − 2/(e^{2x} + 1), which is vectorized. Its absolute error is a rounding of 1,
// enough for a saturating force, and Eigen's exponential saturates at both ends. The warning is
// disabled because GCC 12 mistakes the undefined operand of AVX-512's intrinsics for an
// uninitialized variable (GCC bug 105593).
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wuninitialized"
inline Lane Tanh(const Lane& x) { return 1 - 2 / ((2 * x).exp() + 1); }
#pragma GCC diagnostic pop

inline double Atan2(double y, double x) { return std::atan2(y, x); }

inline Lane Atan2(const Lane& y, const Lane& x) {
  Lane angle;
  for (int i = 0; i < kLanes; ++i) angle[i] = std::atan2(y[i], x[i]);
  return angle;
}

// Returns x if it is above 0, else NaN. It guards a quantity for which the equations are undefined
// otherwise: the trajectory is then reported as failed instead of continuing with meaningless
// numbers.
inline double PositiveOrNan(double x) {
  return x > 0 ? x : std::numeric_limits<double>::quiet_NaN();
}

inline Lane PositiveOrNan(const Lane& x) {
  return (x > 0).select(x, std::numeric_limits<double>::quiet_NaN());
}

}  // namespace polyest::internal
