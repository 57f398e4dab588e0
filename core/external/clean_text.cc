#include "core/external/clean_text.h"

#include "core/common/utf8.h"

namespace polyest::internal {

std::string CleanText(const std::string& text, size_t max_bytes) {
  std::string clean = ValidUtf8(std::string(CutAt(text, max_bytes)));
  for (char& c : clean) {
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7f') c = ' ';
  }
  while (!clean.empty() && clean.back() == ' ') clean.pop_back();
  return clean;
}

}  // namespace polyest::internal
