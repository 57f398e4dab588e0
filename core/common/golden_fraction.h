#pragma once

#include <numbers>

namespace polyest::internal {

// The fractional parts of its multiples fill the unit interval most evenly, however many they are.
inline constexpr double kGoldenFraction = std::numbers::phi - 1;

}  // namespace polyest::internal
