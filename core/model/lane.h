#pragma once

// The scalar type that a model's equations are evaluated with, and the functions of it that
// Eigen's own do not serve for.

#include <cmath>

#include "core/common/types.h"

namespace polyest {

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

}  // namespace polyest
