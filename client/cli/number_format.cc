#include "client/cli/number_format.h"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

namespace polyest::internal {
namespace {

// Returns the decimal exponent of the leading digit after rounding to two significant digits, so
// that 0.0996 counts as 0.10.
int LeadingExponent(double value) {
  const std::string text = absl::StrFormat("%.1e", value);
  int exponent = 0;
  (void)absl::SimpleAtoi(text.substr(text.find('e') + 1), &exponent);
  return exponent;
}

// Returns whether a value with that many decimals is printed without an exponent.
bool IsPlain(double value, int decimals) {
  return decimals >= -4 && decimals <= 8 && std::abs(value) < 1e7;
}

}  // namespace

std::string FormatValue(double value, double standard_deviation) {
  if (!std::isfinite(standard_deviation) || standard_deviation <= 0 || !std::isfinite(value)) {
    return FormatNumber(value, 6);
  }
  const int decimals = 1 - LeadingExponent(standard_deviation);
  if (IsPlain(value, decimals)) return absl::StrFormat("%.*f", std::max(decimals, 0), value);
  const int digits = value == 0 ? 1 : LeadingExponent(std::abs(value)) + decimals;
  return absl::StrFormat("%.*e", std::clamp(digits, 1, 15), value);
}

std::string FormatUncertain(double value, double standard_deviation) {
  const bool known = std::isfinite(standard_deviation) && standard_deviation > 0;
  const bool plain = known && IsPlain(value, 1 - LeadingExponent(standard_deviation));
  // Value and standard deviation are printed in the same notation.
  return absl::StrCat(FormatValue(value, standard_deviation), " ± ",
                      known && !plain ? absl::StrFormat("%.1e", standard_deviation)
                                      : FormatValue(standard_deviation, standard_deviation));
}

std::string FormatNumber(double value, int digits) {
  return absl::StrFormat("%.*g", digits, value);
}

std::string FormatExact(double value) {
  char text[32];
  const auto result = std::to_chars(text, text + sizeof(text), value);
  return std::string(text, result.ptr);
}

std::string UnitText(const std::string& unit) { return unit == "1" ? "" : unit; }

std::string NameWithUnit(const std::string& name, const std::string& unit) {
  const std::string text = UnitText(unit);
  return text.empty() ? name : absl::StrCat(name, " (", text, ")");
}

std::string FormatPercent(double probability) { return FormatNumber(100 * probability) + " %"; }

}  // namespace polyest::internal
