#pragma once

// Texts that are, or should be, in UTF-8.

#include <absl/strings/string_view.h>

#include <cstddef>
#include <string>

namespace polyest::internal {

// Returns whether a byte continues a character: each of its bytes but the first does.
inline bool ContinuesCharacter(char byte) {
  return (static_cast<unsigned char>(byte) & 0xC0) == 0x80;
}

// Returns the length in bytes of the character at the beginning of a text, which must not be empty.
// Returns 0 if there is none: it is cut off, longer than needed, a surrogate, or beyond U+10FFFF.
size_t CharacterLength(absl::string_view text);

// Returns whether all bytes belong to characters. Tells nothing about their meaning: ASCII is
// UTF-8.
bool IsUtf8(absl::string_view text);

// Returns the text with '?' in place of each byte that belongs to no character.
std::string ValidUtf8(std::string text);

// Returns the beginning of a text, of at most `max_bytes` bytes, which ends with a whole character
// if the text is in UTF-8.
absl::string_view CutAt(absl::string_view text, size_t max_bytes);

}  // namespace polyest::internal
