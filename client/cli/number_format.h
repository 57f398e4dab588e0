#pragma once

// Formats numbers and their units for readers.

#include <string>

namespace polyest::internal {

// Returns a value with as many decimals as two significant digits of `standard_deviation` have:
// 40.6612 for 0.0052. Returns six significant digits when the standard deviation is not positive or
// not finite.
std::string FormatValue(double value, double standard_deviation);
// Returns value and standard deviation as "40.6612 ± 0.0052".
std::string FormatUncertain(double value, double standard_deviation);
// Returns an interval as "40.6510 … 40.6714", and as "1.1e-07 … 2.2e-05" where its ends are decades
// apart.
std::string FormatInterval(double lower, double upper, double standard_deviation);
// Returns a value with at most `digits` significant digits.
std::string FormatNumber(double value, int digits = 4);
// Returns the number nearest to a value that has at most `digits` significant digits.
double Rounded(double value, int digits);
// Returns a probability as "97.5 %".
std::string FormatPercent(double probability);
// Returns a unit as it is printed: nothing for the plain number's "1".
std::string UnitText(const std::string& unit);
// Returns "x (m)", or the name alone for a plain number.
std::string NameWithUnit(const std::string& name, const std::string& unit);
// Returns the shortest text that gives exactly the same number when read back.
std::string FormatExact(double value);

}  // namespace polyest::internal
