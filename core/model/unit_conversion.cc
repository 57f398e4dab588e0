#include "core/model/unit_conversion.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>

#include "core/common/status.h"
#include "core/model/equations/text_error.h"
#include "core/model/units.h"

namespace polyest::internal {
namespace {

struct Spelling {
  std::string_view recorded;
  std::string_view unit;
};

// Spellings in files of measurements that are not units of their own.
constexpr Spelling kSpellings[] = {
    {"-", "1"},          {"sec", "s"},      {"secs", "s"},      {"second", "s"},
    {"seconds", "s"},    {"Sekunden", "s"}, {"msec", "ms"},     {"milliseconds", "ms"},
    {"usec", "us"},      {"degree", "deg"}, {"degrees", "deg"}, {"Grad", "deg"},
    {"U/min", "1/min"},  {"kph", "km/h"},   {"kmh", "km/h"},    {"deg/sec", "deg/s"},
    {"Grad/s", "deg/s"}, {"Nm", "N m"},     {"kNm", "kN m"},    {"Nmm", "N mm"},
    {"Ns/m", "N s/m"},   {"inch", "in"},    {"inches", "in"},   {"feet", "ft"},
    {"lbs", "lb"},
};

// Spellings of temperatures in degrees Celsius, whose steps are those of K.
constexpr std::string_view kCelsius[] = {"°C", "℃", "deg C", "degC", "° C", "Celsius"};
constexpr double kZeroCelsius = 273.15;  // K

// Spellings of accelerations in standard gravity, which are masses otherwise.
constexpr Spelling kGravities[] = {{"g", "gn"}, {"mg", "mgn"}, {"µg", "µgn"}, {"ug", "ugn"}};

bool IsCelsius(std::string_view recorded) {
  return std::find(std::begin(kCelsius), std::end(kCelsius), recorded) != std::end(kCelsius);
}

std::string_view UnitOf(std::string_view recorded) {
  if (IsCelsius(recorded)) return "K";
  for (const Spelling& spelling : kSpellings) {
    if (spelling.recorded == recorded) return spelling.unit;
  }
  return recorded;
}

// Replaces a mass by a multiple of gravity where the model has an acceleration.
std::string_view WithGravity(std::string_view recorded, const Unit& model) {
  for (const Spelling& gravity : kGravities) {
    if (gravity.recorded == recorded && SameDimension(*ParseUnit("m/s^2"), model)) {
      return gravity.unit;
    }
  }
  return recorded;
}

bool HasAny(std::string_view text, std::initializer_list<std::string_view> symbols) {
  for (const std::string_view symbol : symbols) {
    if (text.find(symbol) != text.npos) return true;
  }
  return false;
}

bool CountsCycles(std::string_view unit) { return HasAny(unit, {"Hz"}); }
bool CountsAngles(std::string_view unit) { return HasAny(unit, {"rad", "deg", "°", "rpm"}); }

bool IsAngularVelocity(std::string_view text, const Unit& unit) {
  return SameDimension(unit, *ParseUnit("1/s")) && CountsAngles(text);
}

// Whether a unit is 1/min, which does not say what it counts.
bool IsPerMinute(std::string_view text, const Unit& unit) {
  return SameUnit(unit, *ParseUnit("1/min")) && !CountsCycles(text) && !CountsAngles(text);
}

UnitConversion ByScale(double scale) {
  constexpr double kRounding = 1e-12;
  const double inverse = 1 / scale;
  const double whole = std::round(inverse);
  if (scale < 1 && whole < 1e15 && std::abs(inverse - whole) <= kRounding * whole) {
    return {.divisor = whole};
  }
  const bool is_whole = std::abs(scale - std::round(scale)) <= kRounding * scale;
  return {.multiplier = is_whole ? std::round(scale) : scale};
}

}  // namespace

absl::Status CheckRecordedUnit(std::string_view recorded) {
  return ParseUnit(UnitOf(recorded)).status();
}

absl::StatusOr<UnitConversion> ConvertUnit(std::string_view recorded, std::string_view model) {
  if (recorded == model) return UnitConversion();
  const std::string_view model_text = UnitOf(model);
  POLYEST_ASSIGN_OR_RETURN(const Unit to, ParseUnit(model_text));
  const std::string_view text = UnitOf(WithGravity(recorded, to));
  POLYEST_ASSIGN_OR_RETURN(Unit from, ParseUnit(text));
  const auto differ = [&](std::string_view why) {
    return absl::InvalidArgumentError(absl::StrFormat("values in %s cannot be converted to %s: %s",
                                                      equations::Quoted(recorded),
                                                      equations::Quoted(model), why));
  };
  if (!SameDimension(from, to)) return differ("their dimensions differ");
  if ((CountsCycles(text) && CountsAngles(model_text)) ||
      (CountsAngles(text) && CountsCycles(model_text))) {
    return differ("one counts cycles, the other angles");
  }
  // Test rigs write speeds of rotation in 1/min, which are turns; none writes radians per minute.
  if (IsAngularVelocity(model_text, to) && IsPerMinute(text, from)) from = *ParseUnit("rpm");
  if (IsPerMinute(model_text, to) && IsAngularVelocity(text, from)) {
    return differ("one counts cycles, the other angles");
  }
  UnitConversion conversion = ByScale(from.scale / to.scale);
  if (IsCelsius(recorded) && !IsCelsius(model)) conversion.offset = kZeroCelsius / to.scale;
  return conversion;
}

}  // namespace polyest::internal
