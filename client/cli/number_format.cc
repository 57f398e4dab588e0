#include "client/cli/number_format.h"

#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>

namespace polyest::internal {
namespace {

// Ratio of an interval's ends below which each is printed with digits of its own.
constexpr double kDecades = 0.01;

// Returns the decimal exponent of the leading digit after rounding to two significant digits, so
// that 0.0996 counts as 0.10.
int LeadingExponent(double value) {
  const std::string text = absl::StrFormat("%.1e", value);
  int exponent = 0;
  (void)absl::SimpleAtoi(text.substr(text.find('e') + 1), &exponent);
  return exponent;
}

// Returns whether a value is printed without an exponent: neither it nor what is known of it has
// many zeros.
bool IsPlain(double value, double standard_deviation) {
  const int decimals = 1 - LeadingExponent(standard_deviation);
  return decimals >= -4 && decimals <= 8 && std::abs(value) < 1e7 &&
         std::max(std::abs(value), standard_deviation) >= 1e-4;
}

}  // namespace

std::string FormatValue(double value, double standard_deviation) {
  if (!std::isfinite(standard_deviation) || standard_deviation <= 0 || !std::isfinite(value)) {
    return FormatNumber(value, 6);
  }
  const int decimals = 1 - LeadingExponent(standard_deviation);
  if (!IsPlain(value, standard_deviation)) {
    const int digits = value == 0 ? 1 : LeadingExponent(std::abs(value)) + decimals;
    return absl::StrFormat("%.*e", std::clamp(digits, 1, 15), value);
  }
  return absl::StrFormat("%.*f", std::max(decimals, 0), value);
}

std::string FormatUncertain(double value, double standard_deviation) {
  const std::string text = FormatValue(value, standard_deviation);
  if (!std::isfinite(standard_deviation) || standard_deviation <= 0) {
    return absl::StrCat(text, " ± ", FormatNumber(standard_deviation, 6));
  }
  // Value and standard deviation are printed in the same notation.
  if (!IsPlain(value, standard_deviation)) {
    return absl::StrCat(text, " ± ", absl::StrFormat("%.1e", standard_deviation));
  }
  const int decimals = std::max(0, 1 - LeadingExponent(standard_deviation));
  return absl::StrCat(text, " ± ", absl::StrFormat("%.*f", decimals, standard_deviation));
}

std::string FormatInterval(double lower, double upper, double standard_deviation) {
  const double least = std::min(std::abs(lower), std::abs(upper));
  const double most = std::max(std::abs(lower), std::abs(upper));
  if (lower * upper > 0 && least < kDecades * most) {
    return absl::StrCat(FormatNumber(lower, 2), " … ", FormatNumber(upper, 2));
  }
  return absl::StrCat(FormatValue(lower, standard_deviation), " … ",
                      FormatValue(upper, standard_deviation));
}

std::string FormatNumber(double value, int digits) {
  return absl::StrFormat("%.*g", digits, value);
}

double Rounded(double value, int digits) {
  return std::strtod(FormatNumber(value, digits).c_str(), nullptr);
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
