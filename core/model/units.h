#pragma once

// Units of measurement: products of powers of the SI base units with a scale factor.
//
// A unit is written as factors separated by spaces, * or ·, each with an optional power. A /
// applies only to the factor after it, or to a group in parentheses: "kg m^2", "N s/m", "m/s/s",
// "J/(kg K)", "1/s", "mm". The ^ may be left out: "m/s2", "s-1", "m s⁻²". A positive number is a
// factor of the scale. "1" is the unit of a plain number, as are rad and sr; deg and ° are π/180,
// gn is standard gravity. Symbols are case-sensitive and take the SI prefixes (µ may be written u).

#include <absl/status/statusor.h>

#include <array>
#include <string>
#include <string_view>

namespace polyest::internal {

struct Unit {
  // Powers of m, kg, s, A, K, mol, cd.
  std::array<double, 7> powers = {};
  // Size of this unit in SI base units: 0.001 for mm.
  double scale = 1;

  bool IsPlain() const;  // whether it is "1", the unit of a plain number
};

// Parses a unit. Returns InvalidArgument that states the error and, for an unknown symbol, lists
// the known ones.
absl::StatusOr<Unit> ParseUnit(std::string_view text);

Unit operator*(const Unit& a, const Unit& b);
Unit operator/(const Unit& a, const Unit& b);
// Returns the unit raised to a power, which need not be an integer.
Unit Power(const Unit& unit, double exponent);

// Whether the units agree up to rounding; SameDimension ignores the scale.
bool SameUnit(const Unit& a, const Unit& b);
bool SameDimension(const Unit& a, const Unit& b);

// Returns text that ParseUnit reads back as this unit: "N", "kg m^2/s".
std::string FormatUnit(const Unit& unit);

}  // namespace polyest::internal
