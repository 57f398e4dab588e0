#pragma once

// Turns the bytes of a text file into UTF-8.

#include <absl/strings/string_view.h>

#include <cstddef>
#include <string>

namespace polyest::internal {

// Encodings that the beginning of a file shows. Text in Windows-1252 or Latin-1 differs from UTF-8
// only where it has a letter beyond ASCII, which may come late: see ToUtf8.
enum class Encoding { kUtf8, kUtf16Little, kUtf16Big };

struct EncodingFound {
  Encoding encoding = Encoding::kUtf8;
  size_t mark_bytes = 0;  // length of the byte order mark
};

// Number of bytes that FindEncoding needs, unless the file is shorter.
inline constexpr size_t kEncodingBytes = 4;

// Returns the encoding by the byte order mark or, without one, by the zeros between the bytes of
// the first two characters.
EncodingFound FindEncoding(absl::string_view beginning);

// Decodes UTF-16 in pieces that may end within a character.
class Utf16Decoder {
 public:
  explicit Utf16Decoder(bool big_endian) : big_endian_(big_endian) {}

  // Appends the characters of the next bytes to `utf8`, at most 3 bytes for 2. A half of a pair
  // without the other becomes U+FFFD.
  void Append(absl::string_view bytes, std::string& utf8);
  // Whether the bytes so far end within a character.
  bool ends_within() const { return has_byte_ || high_ != 0; }

 private:
  void AppendUnit(unsigned unit, std::string& utf8);

  const bool big_endian_;
  bool has_byte_ = false;
  unsigned byte_ = 0;  // the first of a character whose second is to come
  unsigned high_ = 0;  // the first half of a pair whose second is to come
};

// Returns the bytes if they are UTF-8; otherwise takes them for Windows-1252, which is Latin-1
// with typographic characters.
std::string ToUtf8(absl::string_view bytes);

}  // namespace polyest::internal
