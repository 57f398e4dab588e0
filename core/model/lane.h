#pragma once

// The scalar type that a model's equations are evaluated with, and the functions of it that
// Eigen's own do not serve for.

#include <cmath>
#include <limits>

#include "core/common/types.h"

namespace polyest::internal {

// kLanes points of one quantity.
using Lane = Eigen::Array<double, kLanes, 1>;

inline double Sqrt(double x) { return std::sqrt(x); }

// Correctly rounded and thus the same as for a single point; Eigen's own is an approximation
// refined by Newton steps where there is an instruction for it (AVX-512).
inline Lane Sqrt(const Lane& x) {
  Lane root;
  for (int i = 0; i < kLanes; ++i) root[i] = std::sqrt(x[i]);
  return root;
}

inline double Tanh(double x) { return std::tanh(x); }

// Exact to a rounding of 1, which is all that a force that saturates needs; Eigen's exponential
// saturates at both ends and is vectorized: tanh x = 1 − 2/(e^{2x} + 1). (GCC 12 takes the
// undefined operand of AVX-512's intrinsics for an uninitialized variable: GCC bug 105593.)
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

// x where it is above 0, else NaN: for a quantity whose equations say nothing there, so that the
// trajectory is reported as failed instead of going on with numbers that mean nothing.
inline double PositiveOrNan(double x) {
  return x > 0 ? x : std::numeric_limits<double>::quiet_NaN();
}

inline Lane PositiveOrNan(const Lane& x) {
  return (x > 0).select(x, std::numeric_limits<double>::quiet_NaN());
}

}  // namespace polyest::internal
