#include "core/model/equations/text_error.h"

#include <absl/strings/escaping.h>
#include <absl/strings/str_format.h>

#include <algorithm>

#include "core/common/field_error.h"

namespace polyest::internal::equations {
namespace {

constexpr size_t kMaxQuoted = 24;  // bytes

bool Continues(char byte) { return (static_cast<unsigned char>(byte) & 0xC0) == 0x80; }

// Returns the length in bytes of the character at the beginning of the text, or 0 if it is not
// valid UTF-8: truncated, longer than needed, a surrogate, or beyond U+10FFFF.
size_t CharacterLength(std::string_view text) {
  const auto byte = [text](size_t i) { return static_cast<unsigned char>(text[i]); };
  if (byte(0) < 0x80) return 1;
  const size_t length = byte(0) < 0xC2 ? 0 : byte(0) < 0xE0 ? 2 : byte(0) < 0xF0 ? 3 : 4;
  if (length == 0 || byte(0) > 0xF4 || length > text.size()) return 0;
  for (size_t i = 1; i < length; ++i) {
    if (!Continues(text[i])) return 0;
  }
  const unsigned first_two = byte(0) * 256u + byte(1);
  const bool valid = !(first_two < 0xE0A0 && length == 3) &&
                     !(first_two > 0xED9F && first_two < 0xEE00) &&
                     !(first_two < 0xF090 && length == 4) && first_two <= 0xF48F;
  return valid ? length : 0;
}

bool IsPlain(std::string_view text) {
  while (!text.empty()) {
    const size_t length = CharacterLength(text);
    if (length == 0 || (length == 1 && (text[0] < ' ' || text[0] > '~'))) return false;
    text.remove_prefix(length);
  }
  return true;
}

}  // namespace

std::string Quoted(std::string_view text) {
  size_t length = std::min(text.size(), kMaxQuoted);
  while (length > 0 && length < text.size() && Continues(text[length])) --length;
  std::string quoted(text.substr(0, length));
  if (!IsPlain(quoted)) quoted = absl::CHexEscape(quoted);
  return absl::StrFormat("\"%s%s\"", quoted, length < text.size() ? "…" : "");
}

absl::Status ErrorAt(const FieldPath& field, std::string_view text, size_t offset,
                     std::string_view message) {
  const auto begin = text.begin();
  const auto column = 1 + std::count_if(begin, begin + static_cast<std::ptrdiff_t>(offset),
                                        [](char byte) { return !Continues(byte); });
  const std::string where =
      offset < text.size() ? "at " + Quoted(text.substr(offset)) : std::string("at the end");
  return InvalidField(field, absl::StrFormat("column %d: %s (%s)", column, message, where));
}

}  // namespace polyest::internal::equations
