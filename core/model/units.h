#pragma once

// Units of measurement as products of powers of the SI's base units, with a scale.
//
// A unit is written as its factors, separated by spaces, * or ·, each with an optional power; a /
// holds for the one factor after it, or for a group in parentheses: "kg m^2", "N s/m",
// "m/s/s", "J/(kg K)", "1/s", "mm". "1" is that of a plain number, and so are rad and sr; deg is
// π/180. Symbols are case-sensitive and take the SI's prefixes (µ may be written u).

#include <absl/status/statusor.h>

#include <array>
#include <string>
#include <string_view>

namespace polyest::internal {

struct Unit {
  // Powers of m, kg, s, A, K, mol, cd.
  std::array<double, 7> powers = {};
  // One of this unit in base units: 0.001 for mm.
  double scale = 1;

  bool IsPlain() const;  // "1"
};

// INVALID_ARGUMENT with what is wrong, and the known symbols where one is not.
absl::StatusOr<Unit> ParseUnit(std::string_view text);

Unit operator*(const Unit& a, const Unit& b);
Unit operator/(const Unit& a, const Unit& b);
Unit Power(const Unit& unit, double exponent);

// Up to rounding.
bool SameUnit(const Unit& a, const Unit& b);
bool SameDimension(const Unit& a, const Unit& b);

// "N/m", "kg m^2/s": what ParseUnit reads as this unit again.
std::string FormatUnit(const Unit& unit);

}  // namespace polyest::internal
