#include "core/model/equations/text_error.h"

#include <absl/strings/escaping.h>
#include <absl/strings/str_format.h>

#include <algorithm>

namespace polyest::equations {
namespace {

constexpr size_t kMostQuoted = 24;  // bytes

bool Continues(char byte) { return (static_cast<unsigned char>(byte) & 0xC0) == 0x80; }

bool IsPlain(char byte) { return byte >= ' ' && byte <= '~'; }

}  // namespace

std::string Quoted(std::string_view text) {
  size_t length = std::min(text.size(), kMostQuoted);
  while (length > 0 && length < text.size() && Continues(text[length])) --length;
  std::string quoted(text.substr(0, length));
  if (!std::all_of(quoted.begin(), quoted.end(), IsPlain))
    quoted = absl::Utf8SafeCHexEscape(quoted);
  return absl::StrFormat("\"%s%s\"", quoted, length < text.size() ? "…" : "");
}

absl::Status ErrorAt(std::string_view field, std::string_view text, size_t offset,
                     std::string_view message) {
  const auto begin = text.begin();
  const auto column = 1 + std::count_if(begin, begin + static_cast<std::ptrdiff_t>(offset),
                                        [](char byte) { return !Continues(byte); });
  const std::string where =
      offset < text.size() ? "at " + Quoted(text.substr(offset)) : std::string("at the end");
  return absl::InvalidArgumentError(
      absl::StrFormat("%s: column %d: %s (%s)", field, column, message, where));
}

}  // namespace polyest::equations
