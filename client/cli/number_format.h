#pragma once

// Numbers as a person wants to read them.

#include <string>

namespace polyest::internal {

// Returns a value with the decimals that its uncertainty leaves: two significant digits of
// `standard_deviation`, as in 40.6612 beside 0.0052. Six significant digits when the uncertainty is
// 0 or not finite.
std::string FormatValue(double value, double standard_deviation);
// Returns "40.6612 ± 0.0052".
std::string FormatUncertain(double value, double standard_deviation);
// Returns at most `digits` significant digits.
std::string FormatNumber(double value, int digits = 4);
// Returns a probability as "97.5 %".
std::string FormatPercent(double probability);
// Returns all digits that tell the value from its neighbours: what is read back is the same number.
std::string FormatExact(double value);

}  // namespace polyest::internal
