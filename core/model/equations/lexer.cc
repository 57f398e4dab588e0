#include "core/model/equations/lexer.h"

#include <absl/strings/str_format.h>

#include <charconv>
#include <cmath>
#include <system_error>

#include "core/model/equations/limits.h"
#include "core/model/equations/text_error.h"

namespace polyest::internal::equations {
namespace {

bool IsSpace(char c) { return c == ' ' || c == '\t' || c == '\n' || c == '\r'; }
bool IsDigit(char c) { return c >= '0' && c <= '9'; }
bool BelongsToName(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_' || IsDigit(c);
}

// Symbols of two characters come before those of one, so "<=" is not read as "<".
constexpr std::string_view kSymbols[] = {"<=", ">=", "==", "!=", "&&", "||", "**", "+", "-",
                                         "*",  "/",  "^",  "(",  ")",  ",",  "<",  ">", "!"};

std::string_view Hint(char c) {
  switch (c) {
    case '=':
      return "a lone =; equality is ==";
    case '&':
      return "a lone &; \"and\" is &&";
    case '|':
      return "a lone |; \"or\" is ||, the absolute value abs(x)";
    case '%':
      return "unexpected %; the remainder is mod(a, b)";
    case '[':
    case '{':
      return "unexpected bracket; only ( ) group";
    default:
      return "unexpected character";
  }
}

}  // namespace

absl::Status Lexer::Error(size_t offset, std::string_view message) const {
  return ErrorAt(field_, text_, offset, message);
}

size_t Lexer::Skip(size_t from, bool (*belongs)(char)) const {
  while (from < text_.size() && belongs(text_[from])) ++from;
  return from;
}

absl::StatusOr<Token> Lexer::Next() {
  offset_ = Skip(offset_, IsSpace);
  if (offset_ == text_.size()) return Token{.kind = Token::Kind::kEnd, .offset = offset_};
  const char first = text_[offset_];
  const bool point = first == '.' && offset_ + 1 < text_.size() && IsDigit(text_[offset_ + 1]);
  if (IsDigit(first) || point) return Number();
  if (!BelongsToName(first)) return Symbol();
  size_t end = Skip(offset_, BelongsToName);
  // A name may have parts separated by points, as in u.delay.
  while (end + 1 < text_.size() && text_[end] == '.' && BelongsToName(text_[end + 1]) &&
         !IsDigit(text_[end + 1])) {
    end = Skip(end + 1, BelongsToName);
  }
  const Token token{Token::Kind::kName, offset_, text_.substr(offset_, end - offset_)};
  if (token.text.size() > kMaxNameLength) {
    return Error(offset_, absl::StrFormat("a name of %d characters; at most %d", token.text.size(),
                                          kMaxNameLength));
  }
  offset_ = end;
  return token;
}

// Reads digits [. digits] [e [sign] digits]; the digits before the point may be missing.
absl::StatusOr<Token> Lexer::Number() {
  size_t end = Skip(offset_, IsDigit);
  if (end < text_.size() && text_[end] == '.') end = Skip(end + 1, IsDigit);
  if (end < text_.size() && (text_[end] == 'e' || text_[end] == 'E')) {
    size_t digits = end + 1;
    if (digits < text_.size() && (text_[digits] == '+' || text_[digits] == '-')) ++digits;
    const size_t last = Skip(digits, IsDigit);
    if (last > digits) end = last;
  }
  Token token{Token::Kind::kNumber, offset_, text_.substr(offset_, end - offset_)};
  const auto [stop, error] =
      std::from_chars(token.text.data(), token.text.data() + token.text.size(), token.value);
  if (error == std::errc::result_out_of_range || !std::isfinite(token.value)) {
    return Error(offset_, "a number out of range; its size must be between 1e-307 and 1e308");
  }
  if (error != std::errc() || stop != token.text.data() + token.text.size() ||
      (end < text_.size() && (BelongsToName(text_[end]) || text_[end] == '.'))) {
    return Error(offset_, "not a number; products are written with *, numbers like 1.5e-3");
  }
  offset_ = end;
  return token;
}

absl::StatusOr<Token> Lexer::Symbol() {
  const std::string_view rest = text_.substr(offset_);
  for (const std::string_view symbol : kSymbols) {
    if (!rest.starts_with(symbol)) continue;
    if (symbol == "**") return Error(offset_, "unexpected **; powers are written x^2");
    const Token token{Token::Kind::kSymbol, offset_, rest.substr(0, symbol.size())};
    offset_ += symbol.size();
    return token;
  }
  return Error(offset_, Hint(rest[0]));
}

}  // namespace polyest::internal::equations
