#include "proto/wire/json/json_token.h"

#include <absl/strings/ascii.h>
#include <absl/strings/escaping.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/common/utf8.h"

namespace polyest::internal {
namespace {

constexpr size_t kHexDigits = 4;

// Returns for each byte whether it may be a part of a word.
constexpr std::array<bool, 256> PartsOfWords() {
  std::array<bool, 256> parts{};
  for (size_t c = 0; c < parts.size(); ++c) {
    parts[c] = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
               c == '_' || c == '$' || c == '+' || c == '-' || c == '.' || c >= 0x80;
  }
  return parts;
}
constexpr std::array<bool, 256> kIsOfWord = PartsOfWords();

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

// Returns the character at a place, or the byte if it belongs to none.
absl::string_view CharacterAt(absl::string_view json, size_t at) {
  return json.substr(at, std::max<size_t>(CharacterLength(json.substr(at)), 1));
}

// Returns the number behind the "\u" at a place; nothing if there is no such escape.
std::optional<unsigned> UnicodeEscape(absl::string_view json, size_t at) {
  const absl::string_view escape = json.substr(std::min(at, json.size()), 2 + kHexDigits);
  if (escape.size() < 2 + kHexDigits || escape.substr(0, 2) != "\\u") return std::nullopt;
  const absl::string_view digits = escape.substr(2);
  if (!std::all_of(digits.begin(), digits.end(),
                   [](unsigned char c) { return absl::ascii_isxdigit(c); })) {
    return std::nullopt;
  }
  unsigned number = 0;
  return absl::SimpleHexAtoi(digits, &number) ? std::optional(number) : std::nullopt;
}

// Moves `text` behind the escape at its end, or says what is wrong with it.
void TakeEscape(absl::string_view json, JsonToken& text) {
  const size_t at = text.end;
  const absl::string_view rest = json.substr(at + 1);
  text.wrong = at;
  if (!rest.empty() && absl::string_view("\"\\/bfnrt").find(rest[0]) != rest.npos) {
    text.end += 2;
    return;
  }
  if (rest.empty() || rest[0] != 'u') {
    const absl::string_view sign = rest.empty() ? "" : CharacterAt(json, at + 1);
    text.rule = absl::StrCat("\\", ValidUtf8(absl::Utf8SafeCHexEscape(sign)),
                             " is no escape of JSON; a backslash is written \\\\");
    return;
  }
  const std::optional<unsigned> number = UnicodeEscape(json, at);
  if (!number) {
    text.rule = "four hexadecimal digits must follow \\u";
    return;
  }
  const auto is_within = [](unsigned one, unsigned first, unsigned last) {
    return one >= first && one <= last;
  };
  text.end += 2 + kHexDigits;
  if (!is_within(*number, 0xD800, 0xDFFF)) return;
  const std::optional<unsigned> second = UnicodeEscape(json, text.end);
  if (*number < 0xDC00 && second && is_within(*second, 0xDC00, 0xDFFF)) {
    text.end += 2 + kHexDigits;
  } else {
    text.rule = absl::StrFormat("\\u%04x is one half of a character without the other", *number);
  }
}

}  // namespace

JsonToken TextToken(absl::string_view json, size_t begin) {
  JsonToken text{.end = begin + 1, .wrong = begin, .rule = ""};
  while (text.rule.empty()) {
    const int c = text.end < json.size() ? static_cast<unsigned char>(json[text.end]) : '\n';
    if (c == '"') {
      ++text.end;
      return text;
    }
    if (c == '\\') {
      TakeEscape(json, text);
    } else if (c == '\n' || c == '\r') {
      text.wrong = begin;
      text.rule = "the text that begins here has no closing quote on its line";
    } else if (c < ' ') {
      text.wrong = text.end;
      text.rule = absl::StrFormat("the control character U+%04X must be written \\u%04x", c, c);
    } else if (c < 0x80) {
      ++text.end;
    } else if (const size_t length = CharacterLength(json.substr(text.end)); length > 0) {
      text.end += length;
    } else {
      text.wrong = text.end;
      text.rule = absl::StrFormat("the byte 0x%02X is no UTF-8, in which JSON is written", c);
    }
  }
  return text;
}

absl::string_view WordAt(absl::string_view json, size_t at) {
  size_t end = at;
  while (end < json.size() && kIsOfWord[static_cast<unsigned char>(json[end])]) ++end;
  return json.substr(at, end - at);
}

absl::string_view TokenAt(absl::string_view json, size_t at) {
  const absl::string_view word = WordAt(json, at);
  if (!word.empty()) return word;
  if (json[at] != '"') return CharacterAt(json, at);
  const JsonToken text = TextToken(json, at);
  return json.substr(at, text.rule.empty() ? text.end - at : 1);
}

bool IsJsonNumber(absl::string_view word) {
  size_t at = 0;
  const auto take = [&](char one, char other) {
    const bool found = at < word.size() && (word[at] == one || word[at] == other);
    at += found ? 1 : 0;
    return found;
  };
  const auto take_digits = [&] {
    const size_t first = at;
    while (at < word.size() && IsDigit(word[at])) ++at;
    return at > first;
  };
  take('-', '-');
  if (!take('0', '0') && !take_digits()) return false;
  if (take('.', '.') && !take_digits()) return false;
  if (take('e', 'E')) {
    take('+', '-');
    if (!take_digits()) return false;
  }
  return at == word.size();
}

bool IsInRange(absl::string_view number) {
  constexpr size_t kMaxDigits = 300;  // a double has up to 308 before its point
  const bool has_exponent = number.find('e') != number.npos || number.find('E') != number.npos;
  if (number.size() <= kMaxDigits && !has_exponent) return true;
  double value = 0;
  return absl::SimpleAtod(number, &value) && std::isfinite(value);
}

}  // namespace polyest::internal
