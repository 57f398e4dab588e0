#pragma once

// The scalar type in which a model's equations are evaluated. vector_functions.h has more functions
// of it.

#include <cmath>
#include <limits>

#include "core/common/types.h"

namespace polyest::internal {

// The values of one quantity at kLanes points.
using Lane = Eigen::Array<double, kLanes, 1>;

inline double Tanh(double x) { return std::tanh(x); }

// Returns tanh x = 1 − 2/(e^{2x} + 1), which is inlined, unlike HyperbolicTangent. Its absolute
// error is a rounding of 1, enough for a saturating force, and Eigen's exponential saturates at
// both ends. The warning is disabled because GCC 12 mistakes the undefined operand of AVX-512's
// intrinsics for an uninitialized variable (GCC bug 105593).
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wuninitialized"
inline Lane Tanh(const Lane& x) { return 1 - 2 / ((2 * x).exp() + 1); }
#pragma GCC diagnostic pop

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
