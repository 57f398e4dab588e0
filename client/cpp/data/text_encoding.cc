#include "client/cpp/data/text_encoding.h"

#include <absl/strings/match.h>

#include "core/common/utf8.h"

namespace polyest::internal {
namespace {

constexpr unsigned kReplacement = 0xFFFD;

// The characters 0x80 … 0x9F of Windows-1252; those that it does not use are those of Latin-1.
constexpr unsigned kWindows[32] = {0x20AC, 0x81,   0x201A, 0x0192, 0x201E, 0x2026, 0x2020, 0x2021,
                                   0x02C6, 0x2030, 0x0160, 0x2039, 0x0152, 0x8D,   0x017D, 0x8F,
                                   0x90,   0x2018, 0x2019, 0x201C, 0x201D, 0x2022, 0x2013, 0x2014,
                                   0x02DC, 0x2122, 0x0161, 0x203A, 0x0153, 0x9D,   0x017E, 0x0178};

unsigned char ByteAt(absl::string_view bytes, size_t i) {
  return static_cast<unsigned char>(bytes[i]);
}

void AppendCharacter(unsigned character, std::string& utf8) {
  const auto add = [&utf8](unsigned byte) { utf8 += static_cast<char>(byte); };
  if (character < 0x80) {
    add(character);
  } else if (character < 0x800) {
    add(0xC0 | character >> 6);
    add(0x80 | (character & 0x3F));
  } else if (character < 0x10000) {
    add(0xE0 | character >> 12);
    add(0x80 | (character >> 6 & 0x3F));
    add(0x80 | (character & 0x3F));
  } else {
    add(0xF0 | character >> 18);
    add(0x80 | (character >> 12 & 0x3F));
    add(0x80 | (character >> 6 & 0x3F));
    add(0x80 | (character & 0x3F));
  }
}

}  // namespace

EncodingFound FindEncoding(absl::string_view beginning) {
  if (absl::StartsWith(beginning, "\xEF\xBB\xBF")) return {Encoding::kUtf8, 3};
  if (absl::StartsWith(beginning, "\xFF\xFE")) return {Encoding::kUtf16Little, 2};
  if (absl::StartsWith(beginning, "\xFE\xFF")) return {Encoding::kUtf16Big, 2};
  if (beginning.size() < kEncodingBytes) return {};
  const auto zero = [beginning](size_t i) { return beginning[i] == '\0'; };
  if (!zero(0) && zero(1) && !zero(2) && zero(3)) return {Encoding::kUtf16Little, 0};
  if (zero(0) && !zero(1) && zero(2) && !zero(3)) return {Encoding::kUtf16Big, 0};
  return {};
}

void Utf16Decoder::Append(absl::string_view bytes, std::string& utf8) {
  for (size_t i = 0; i < bytes.size(); ++i) {
    const unsigned byte = ByteAt(bytes, i);
    if (has_byte_) AppendUnit(big_endian_ ? byte_ << 8 | byte : byte << 8 | byte_, utf8);
    has_byte_ = !has_byte_;
    byte_ = byte;
  }
}

void Utf16Decoder::AppendUnit(unsigned unit, std::string& utf8) {
  const bool is_low = unit >= 0xDC00 && unit < 0xE000;
  if (high_ != 0) {
    const unsigned high = high_;
    high_ = 0;
    if (is_low) return AppendCharacter(0x10000 + ((high - 0xD800) << 10) + (unit - 0xDC00), utf8);
    AppendCharacter(kReplacement, utf8);
  }
  if (unit >= 0xD800 && unit < 0xDC00) {
    high_ = unit;
  } else {
    AppendCharacter(is_low ? kReplacement : unit, utf8);
  }
}

std::string ToUtf8(absl::string_view bytes) {
  if (IsUtf8(bytes)) return std::string(bytes);
  std::string utf8;
  for (size_t i = 0; i < bytes.size(); ++i) {
    const unsigned byte = ByteAt(bytes, i);
    AppendCharacter(byte >= 0x80 && byte < 0xA0 ? kWindows[byte - 0x80] : byte, utf8);
  }
  return utf8;
}

}  // namespace polyest::internal
