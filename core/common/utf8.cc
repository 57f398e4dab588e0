#include "core/common/utf8.h"

namespace polyest::internal {
namespace {

constexpr size_t kLongestCharacter = 4;  // bytes

unsigned ByteAt(absl::string_view text, size_t i) { return static_cast<unsigned char>(text[i]); }

}  // namespace

size_t CharacterLength(absl::string_view text) {
  const unsigned first = ByteAt(text, 0);
  if (first < 0x80) return 1;
  const size_t length = first < 0xC2 ? 0 : first < 0xE0 ? 2 : first < 0xF0 ? 3 : 4;
  if (length == 0 || first > 0xF4 || length > text.size()) return 0;
  for (size_t i = 1; i < length; ++i) {
    if (!ContinuesCharacter(text[i])) return 0;
  }
  const unsigned first_two = first << 8 | ByteAt(text, 1);
  const bool too_long = (length == 3 && first_two < 0xE0A0) || (length == 4 && first_two < 0xF090);
  const bool surrogate = length == 3 && first_two >= 0xEDA0 && first_two <= 0xEDBF;
  const bool beyond = length == 4 && first_two > 0xF48F;
  return too_long || surrogate || beyond ? 0 : length;
}

bool IsUtf8(absl::string_view text) {
  while (!text.empty()) {
    const size_t length = CharacterLength(text);
    if (length == 0) return false;
    text.remove_prefix(length);
  }
  return true;
}

std::string ValidUtf8(std::string text) {
  for (size_t i = 0; i < text.size();) {
    const size_t length = CharacterLength(absl::string_view(text).substr(i));
    if (length == 0) text[i] = '?';
    i += length == 0 ? 1 : length;
  }
  return text;
}

absl::string_view CutAt(absl::string_view text, size_t max_bytes) {
  if (text.size() <= max_bytes) return text;
  for (size_t back = 0; back < kLongestCharacter && back <= max_bytes; ++back) {
    if (!ContinuesCharacter(text[max_bytes - back])) return text.substr(0, max_bytes - back);
  }
  return text.substr(0, max_bytes);  // not UTF-8
}

}  // namespace polyest::internal
