#include "core/model/units.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "core/common/status.h"
#include "core/model/equations/text_error.h"

namespace polyest::internal {
namespace {

constexpr size_t kMaxText = 200;
constexpr int kMaxGroups = 10;
constexpr double kMaxPower = 100;

struct Symbol {
  std::string_view name;
  std::array<double, 7> powers;  // m, kg, s, A, K, mol, cd
  double scale;
  bool takes_prefixes;
};

constexpr Symbol kSymbols[] = {
    {"m", {1, 0, 0, 0, 0, 0, 0}, 1, true},
    {"g", {0, 1, 0, 0, 0, 0, 0}, 1e-3, true},
    {"s", {0, 0, 1, 0, 0, 0, 0}, 1, true},
    {"A", {0, 0, 0, 1, 0, 0, 0}, 1, true},
    {"K", {0, 0, 0, 0, 1, 0, 0}, 1, true},
    {"mol", {0, 0, 0, 0, 0, 1, 0}, 1, true},
    {"cd", {0, 0, 0, 0, 0, 0, 1}, 1, true},
    {"rad", {0, 0, 0, 0, 0, 0, 0}, 1, true},
    {"sr", {0, 0, 0, 0, 0, 0, 0}, 1, false},
    {"Hz", {0, 0, -1, 0, 0, 0, 0}, 1, true},
    {"N", {1, 1, -2, 0, 0, 0, 0}, 1, true},
    {"Pa", {-1, 1, -2, 0, 0, 0, 0}, 1, true},
    {"J", {2, 1, -2, 0, 0, 0, 0}, 1, true},
    {"W", {2, 1, -3, 0, 0, 0, 0}, 1, true},
    {"C", {0, 0, 1, 1, 0, 0, 0}, 1, true},
    {"V", {2, 1, -3, -1, 0, 0, 0}, 1, true},
    {"F", {-2, -1, 4, 2, 0, 0, 0}, 1, true},
    {"Ohm", {2, 1, -3, -2, 0, 0, 0}, 1, true},
    {"Ω", {2, 1, -3, -2, 0, 0, 0}, 1, true},
    {"S", {-2, -1, 3, 2, 0, 0, 0}, 1, true},
    {"Wb", {2, 1, -2, -1, 0, 0, 0}, 1, true},
    {"T", {0, 1, -2, -1, 0, 0, 0}, 1, true},
    {"H", {2, 1, -2, -2, 0, 0, 0}, 1, true},
    {"lm", {0, 0, 0, 0, 0, 0, 1}, 1, true},
    {"lx", {-2, 0, 0, 0, 0, 0, 1}, 1, true},
    {"deg", {0, 0, 0, 0, 0, 0, 0}, std::numbers::pi / 180, false},
    {"rpm", {0, 0, -1, 0, 0, 0, 0}, std::numbers::pi / 30, false},
    {"min", {0, 0, 1, 0, 0, 0, 0}, 60, false},
    {"h", {0, 0, 1, 0, 0, 0, 0}, 3600, false},
    {"l", {3, 0, 0, 0, 0, 0, 0}, 1e-3, true},
    {"L", {3, 0, 0, 0, 0, 0, 0}, 1e-3, true},
    {"t", {0, 1, 0, 0, 0, 0, 0}, 1e3, true},
    {"bar", {-1, 1, -2, 0, 0, 0, 0}, 1e5, true},
    {"%", {0, 0, 0, 0, 0, 0, 0}, 0.01, false},
    {"°", {0, 0, 0, 0, 0, 0, 0}, std::numbers::pi / 180, false},
    // Standard gravity, in which accelerometers are calibrated.
    {"gn", {1, 0, -2, 0, 0, 0, 0}, 9.80665, true},
    {"in", {1, 0, 0, 0, 0, 0, 0}, 0.0254, false},
    {"ft", {1, 0, 0, 0, 0, 0, 0}, 0.3048, false},
    {"mph", {1, 0, -1, 0, 0, 0, 0}, 0.44704, false},
    {"lb", {0, 1, 0, 0, 0, 0, 0}, 0.45359237, false},
    {"lbf", {1, 1, -2, 0, 0, 0, 0}, 4.4482216152605, false},
    {"kgf", {1, 1, -2, 0, 0, 0, 0}, 9.80665, false},
    {"psi", {-1, 1, -2, 0, 0, 0, 0}, 6894.757293168361, false},
};

struct Prefix {
  std::string_view name;
  double scale;
};

constexpr Prefix kPrefixes[] = {{"da", 1e1}, {"T", 1e12}, {"G", 1e9},  {"M", 1e6},  {"k", 1e3},
                                {"h", 1e2},  {"d", 1e-1}, {"c", 1e-2}, {"m", 1e-3}, {"µ", 1e-6},
                                {"μ", 1e-6}, {"u", 1e-6}, {"n", 1e-9}, {"p", 1e-12}};

std::optional<Unit> FindSymbol(std::string_view text, bool prefixed) {
  for (const Symbol& symbol : kSymbols) {
    if (symbol.name == text && (!prefixed || symbol.takes_prefixes)) {
      return Unit{symbol.powers, symbol.scale};
    }
  }
  if (prefixed) return std::nullopt;
  for (const Prefix& prefix : kPrefixes) {
    if (!text.starts_with(prefix.name)) continue;
    if (auto unit = FindSymbol(text.substr(prefix.name.size()), true)) {
      unit->scale *= prefix.scale;
      return unit;
    }
  }
  return std::nullopt;
}

class UnitParser {
 public:
  explicit UnitParser(std::string_view text) : text_(text) {}

  absl::StatusOr<Unit> Run() {
    if (text_.size() > kMaxText) return Error("is too long");
    POLYEST_ASSIGN_OR_RETURN(const Unit unit, Product(0));
    if (at_ < text_.size()) return Error("has a ) without its (");
    return unit;
  }

 private:
  absl::Status Error(std::string_view message) const {
    return absl::InvalidArgumentError(
        absl::StrFormat("the unit %s %s", equations::Quoted(text_), message));
  }

  bool Take(std::string_view word) {
    if (!text_.substr(at_).starts_with(word)) return false;
    at_ += word.size();
    return true;
  }
  void TakeSpace() {
    while (Take(" ") || Take("\t")) continue;
  }

  absl::StatusOr<Unit> Product(int groups);
  absl::StatusOr<Unit> Factor(int groups);
  absl::StatusOr<Unit> SymbolOrNumber();
  absl::StatusOr<double> Exponent();
  std::optional<double> PlainExponent(size_t at) const;
  std::optional<double> Number();

  std::string_view text_;
  size_t at_ = 0;
};

absl::StatusOr<Unit> UnitParser::Product(int groups) {
  TakeSpace();
  POLYEST_ASSIGN_OR_RETURN(Unit unit, Factor(groups));
  for (;;) {
    TakeSpace();
    if (at_ == text_.size() || text_[at_] == ')') return unit;
    const bool divides = Take("/");
    if (!divides && !Take("*")) Take("·");
    TakeSpace();
    POLYEST_ASSIGN_OR_RETURN(const Unit factor, Factor(groups));
    unit = divides ? unit / factor : unit * factor;
    if (!(unit.scale > 0) || !std::isfinite(unit.scale)) return Error("is out of range");
  }
}

absl::StatusOr<Unit> UnitParser::Factor(int groups) {
  Unit unit;
  if (Take("(")) {
    if (groups == kMaxGroups) return Error("is nested too deep");
    POLYEST_ASSIGN_OR_RETURN(unit, Product(groups + 1));
    if (!Take(")")) return Error("has a ( without its )");
  } else {
    POLYEST_ASSIGN_OR_RETURN(unit, SymbolOrNumber());
  }
  POLYEST_ASSIGN_OR_RETURN(const double exponent, Exponent());
  return Power(unit, exponent);
}

absl::StatusOr<double> UnitParser::Exponent() {
  if (Take("²")) return 2;
  if (Take("³")) return 3;
  if (Take("⁻¹")) return -1;
  if (Take("⁻²")) return -2;
  if (Take("⁻³")) return -3;
  if (const std::optional<double> exponent = PlainExponent(at_)) {
    at_ += *exponent < 0 ? 2 : 1;
    return *exponent;
  }
  if (!Take("^") && !Take("**")) return 1;
  const std::optional<double> exponent = Number();
  if (!exponent || std::abs(*exponent) > kMaxPower) {
    return Error("has a ^ without a number between -100 and 100 after it");
  }
  return *exponent;
}

// Returns the exponent of the symbol or group that ends at a place, if it is written without ^: one
// digit, as in m/s2 or s-1. An exponent of 1 is not written; x1 is rather a name.
std::optional<double> UnitParser::PlainExponent(size_t at) const {
  const auto is_digit = [this](size_t i) {
    return i < text_.size() && text_[i] >= '0' && text_[i] <= '9';
  };
  const bool negative = at > 0 && at < text_.size() && text_[at] == '-';
  const size_t digit = negative ? at + 1 : at;
  if (at == 0 || is_digit(at - 1) || !is_digit(digit)) return std::nullopt;
  const bool ends = digit + 1 == text_.size() ||
                    std::string_view(" \t*/)").find(text_[digit + 1]) != text_.npos ||
                    text_.substr(digit + 1).starts_with("·");
  const int power = text_[digit] - '0';
  if (!ends || power < (negative ? 1 : 2)) return std::nullopt;
  return negative ? -power : power;
}

std::optional<double> UnitParser::Number() {
  double value = 0;
  const auto [stop, error] =
      std::from_chars(text_.data() + at_, text_.data() + text_.size(), value);
  if (error != std::errc() || !std::isfinite(value)) return std::nullopt;
  at_ = static_cast<size_t>(stop - text_.data());
  return value;
}

absl::StatusOr<Unit> UnitParser::SymbolOrNumber() {
  const bool digit = at_ < text_.size() && text_[at_] >= '0' && text_[at_] <= '9';
  if (digit) {
    const std::optional<double> scale = Number();
    if (!scale || !(*scale > 0)) return Error("has a number that is not positive");
    return Unit{{}, *scale};
  }
  size_t end = at_;
  while (end < text_.size() && std::string_view(" \t*/^()").find(text_[end]) == text_.npos &&
         !text_.substr(end).starts_with("·") && !text_.substr(end).starts_with("²") &&
         !text_.substr(end).starts_with("³") && !text_.substr(end).starts_with("⁻") &&
         !PlainExponent(end)) {
    ++end;
  }
  const std::string_view name = text_.substr(at_, end - at_);
  if (name.empty()) return Error("lacks a symbol; the unit of a plain number is 1");
  const std::optional<Unit> unit = FindSymbol(name, false);
  if (unit) {
    at_ = end;
    return *unit;
  }
  std::string known;
  for (const Symbol& symbol : kSymbols) {
    absl::StrAppend(&known, known.empty() ? "" : ", ", std::string(symbol.name));
  }
  return Error(absl::StrFormat(
      "has the unknown symbol %s; the symbols are %s, most of them with the prefixes "
      "T G M k h da d c m u n p, and products are written \"N m\"",
      equations::Quoted(name), known));
}

bool Near(double a, double b) {
  return std::abs(a - b) <= 1e-9 * std::max(std::abs(a), std::abs(b));
}

bool NearPower(double a, double b) { return std::abs(a - b) <= 1e-9; }

}  // namespace

bool Unit::IsPlain() const { return SameUnit(*this, Unit()); }

Unit operator*(const Unit& a, const Unit& b) {
  Unit product = a;
  for (size_t i = 0; i < a.powers.size(); ++i) product.powers[i] += b.powers[i];
  product.scale *= b.scale;
  return product;
}

Unit operator/(const Unit& a, const Unit& b) { return a * Power(b, -1); }

Unit Power(const Unit& unit, double exponent) {
  Unit power = unit;
  for (double& p : power.powers) p *= exponent;
  power.scale = std::pow(unit.scale, exponent);
  return power;
}

bool SameDimension(const Unit& a, const Unit& b) {
  return std::equal(a.powers.begin(), a.powers.end(), b.powers.begin(), NearPower);
}

bool SameUnit(const Unit& a, const Unit& b) {
  return SameDimension(a, b) && Near(a.scale, b.scale);
}

absl::StatusOr<Unit> ParseUnit(std::string_view text) { return UnitParser(text).Run(); }

std::string FormatUnit(const Unit& unit) {
  constexpr std::string_view kBase[] = {"m", "kg", "s", "A", "K", "mol", "cd"};
  for (const std::string_view name : {"N", "Pa", "W", "V", "Ohm", "T"}) {
    if (SameUnit(*FindSymbol(name, false), unit)) return std::string(name);
  }
  std::string above, below;
  if (!Near(unit.scale, 1)) absl::StrAppendFormat(&above, "%.12g", unit.scale);
  for (const size_t i : {1, 0, 2, 3, 4, 5, 6}) {
    const double power = unit.powers[i];
    if (NearPower(power, 0)) continue;
    std::string& side = power > 0 ? above : below;
    const std::string exponent =
        NearPower(std::abs(power), 1) ? "" : absl::StrFormat("^%.12g", std::abs(power));
    const char* separator = power < 0 ? "/" : above.empty() ? "" : " ";
    absl::StrAppend(&side, separator, std::string(kBase[i]), exponent);
  }
  return absl::StrCat(above.empty() ? "1" : above, below);
}

}  // namespace polyest::internal
