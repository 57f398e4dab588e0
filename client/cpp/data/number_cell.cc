#include "client/cpp/data/number_cell.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/strip.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

namespace polyest::internal {
namespace {

// Words for a missing value in spreadsheets (#NV is the German #N/A), Python, R, MATLAB and C.
constexpr absl::string_view kMissingWords[] = {
    "nan", "na", "n/a", "#n/a", "#nv", "null", "none", "-nan", "nil", "(nan)", "-", "--", "–", "—"};

// Stands for apostrophes and spaces that group thousands.
constexpr char kGroup = '\'';
constexpr size_t kMaxNumber = 512;  // characters

struct Spelling {
  absl::string_view text;
  char character;
};
constexpr Spelling kSpellings[] = {{"\xE2\x88\x92", '-'},      // U+2212, the minus
                                   {"\xC2\xA0", kGroup},       // no-break space
                                   {"\xE2\x80\xAF", kGroup},   // narrow no-break space
                                   {"\xE2\x80\x89", kGroup},   // thin space
                                   {"\xE2\x80\x99", kGroup}};  // typographic apostrophe

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

// A number in ASCII.
class Digits {
 public:
  // Copies the text with its minus and its groups in ASCII; false if it is too long.
  bool Assign(absl::string_view text) {
    size_ = 0;
    while (!text.empty()) {
      if (size_ == characters_.size()) return false;
      characters_[size_++] = TakeCharacter(text);
    }
    return true;
  }
  absl::string_view text() const { return {characters_.data(), size_}; }
  void Remove(char c) {
    const auto end = characters_.begin() + static_cast<std::ptrdiff_t>(size_);
    size_ = static_cast<size_t>(std::remove(characters_.begin(), end, c) - characters_.begin());
  }
  void Replace(char from, char to) {
    const auto end = characters_.begin() + static_cast<std::ptrdiff_t>(size_);
    std::replace(characters_.begin(), end, from, to);
  }

 private:
  static char TakeCharacter(absl::string_view& text) {
    for (const Spelling& spelling : kSpellings) {
      if (absl::ConsumePrefix(&text, spelling.text)) return spelling.character;
    }
    const char c = text.front();
    text.remove_prefix(1);
    return c;
  }

  std::array<char, kMaxNumber> characters_;
  size_t size_ = 0;
};

absl::string_view WithoutSign(absl::string_view text) {
  if (!text.empty() && (text[0] == '+' || text[0] == '-')) text.remove_prefix(1);
  return text;
}

// Whether the digits of a whole number are grouped by `mark` into thousands: 1 to 3 digits, then
// groups of 3.
bool AreThousands(absl::string_view whole, char mark) {
  size_t digits = 0;
  bool first = true;
  for (const char c : whole) {
    if (c == mark) {
      if (first ? digits < 1 || digits > 3 : digits != 3) return false;
      first = false;
      digits = 0;
    } else if (IsDigit(c)) {
      ++digits;
    } else {
      return false;
    }
  }
  return !first && digits == 3;
}

NumberCell Convert(absl::string_view text) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  double value = 0;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, value);
  if (error == std::errc::result_out_of_range) return {NumberCell::kOutOfRange, 0};
  if (error != std::errc() || stop != end) return {NumberCell::kNoNumber, 0};
  if (!std::isfinite(value)) return {NumberCell::kNotFinite, 0};
  return {NumberCell::kNumber, value};
}

// Reads a number that has marks beside the digits of its whole part and its decimal mark.
NumberCell ReadGrouped(Digits& digits, char decimal, char mark, bool named) {
  const absl::string_view number = WithoutSign(digits.text());
  const size_t point = std::min(number.find(decimal), number.size());
  const absl::string_view whole = number.substr(0, point);
  if (number.find(mark, point) != number.npos || !AreThousands(whole, mark)) {
    const bool one = std::count(number.begin(), number.end(), mark) == 1;
    return {mark != kGroup && one ? NumberCell::kOtherDecimal : NumberCell::kNoNumber, 0};
  }
  const bool one_reading = mark == kGroup || named || point < number.size() ||
                           std::count(whole.begin(), whole.end(), mark) > 1 || whole[0] == '0';
  if (!one_reading) return {NumberCell::kTwoReadings, 0};
  if (whole[0] == '0') return {NumberCell::kOtherDecimal, 0};
  digits.Remove(mark);
  digits.Replace(decimal, '.');
  return Convert(digits.text());
}

}  // namespace

bool IsMissingWord(absl::string_view text) {
  if (text.empty()) return true;
  return std::any_of(std::begin(kMissingWords), std::end(kMissingWords),
                     [text](absl::string_view word) { return absl::EqualsIgnoreCase(text, word); });
}

NumberCell ReadNumberCell(absl::string_view text, const NumberStyle& style) {
  if (IsMissingWord(text)) return {NumberCell::kMissing, 0};
  Digits digits;
  if (!digits.Assign(text)) return {NumberCell::kNoNumber, 0};
  const char other = style.decimal == '.' ? ',' : '.';
  for (const char mark : {other, kGroup}) {
    if (digits.text().find(mark) == absl::string_view::npos) continue;
    NumberCell cell = ReadGrouped(digits, style.decimal, mark, style.named);
    // What is not a number with its decimal marks exchanged has no other decimal mark either.
    if (cell.kind == NumberCell::kOtherDecimal) {
      digits.Replace(other, '.');
      const bool has_both = text.find(style.decimal) != absl::string_view::npos;
      if (!has_both && Convert(digits.text()).kind != NumberCell::kNumber) return {};
    }
    return cell;
  }
  digits.Replace(style.decimal, '.');
  return Convert(digits.text());
}

DecimalEvidence DecimalEvidenceOf(absl::string_view text) {
  Digits digits;
  if (!digits.Assign(text)) return DecimalEvidence::kNone;
  digits.Remove(kGroup);
  const absl::string_view number = WithoutSign(digits.text());
  if (number.empty() || number.find_first_not_of("0123456789.,eE+-") != number.npos) {
    return DecimalEvidence::kNone;
  }
  const auto points = std::count(number.begin(), number.end(), '.');
  const auto commas = std::count(number.begin(), number.end(), ',');
  if (points == 0 && commas == 0) return DecimalEvidence::kNone;
  if (points == 1 && commas == 0) return DecimalEvidence::kPoint;
  if (points == 0 && commas == 1) {
    const bool group = AreThousands(number, ',') && number[0] != '0';
    return group ? DecimalEvidence::kCommaOrGroup : DecimalEvidence::kComma;
  }
  // With several marks, the one that groups thousands is not the decimal mark.
  const size_t last = number.find_last_of(".,");
  const bool both = points > 0 && commas > 0;
  const char mark = both ? (number[last] == '.' ? ',' : '.') : number[last];
  if (!AreThousands(both ? number.substr(0, last) : number, mark)) return DecimalEvidence::kNone;
  return mark == '.' ? DecimalEvidence::kComma : DecimalEvidence::kPoint;
}

}  // namespace polyest::internal
