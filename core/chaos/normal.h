#pragma once

// The standard normal distribution.

#include <cmath>
#include <numbers>

namespace polyest::internal {

inline constexpr double kLogTwoPi = 1.8378770664093454836;  // log 2π

// Returns the distribution function at z. The complementary error function keeps the lower tail.
inline double NormalCdf(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

}  // namespace polyest::internal
