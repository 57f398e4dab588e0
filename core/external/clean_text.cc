#include "core/external/clean_text.h"

#include <pugixml.hpp>

namespace polyest::internal {

std::string CleanText(const std::string& text, size_t max_bytes) {
  // The conversion to wide characters drops invalid UTF-8, including a character that was cut in
  // two, but not what UTF-8 must not encode.
  std::wstring wide = pugi::as_wide(text.substr(0, max_bytes));
  std::erase_if(wide, [](wchar_t c) { return (c >= 0xD800 && c <= 0xDFFF) || c > 0x10FFFF; });
  std::string clean = pugi::as_utf8(wide);
  for (char& c : clean) {
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7f') c = ' ';
  }
  while (!clean.empty() && clean.back() == ' ') clean.pop_back();
  return clean;
}

}  // namespace polyest::internal
