#pragma once

// The χ² distribution as a normal one.

#include <cmath>

namespace polyest::internal {

// Returns the normal deviate that is as improbable as a χ² variable with so many degrees of freedom
// (> 0). Source: E. Wilson and M. Hilferty, "The distribution of chi-square", Proc. National
// Academy of Sciences 17 (1931).
inline double NormalDeviateOfChiSquared(double chi_squared, double degrees) {
  const double variance = 2 / (9 * degrees);
  return (std::cbrt(chi_squared / degrees) - (1 - variance)) / std::sqrt(variance);
}

}  // namespace polyest::internal
