#include "core/model/equations/text_error.h"

#include <absl/strings/escaping.h>
#include <absl/strings/str_format.h>
#include <absl/strings/string_view.h>

#include <algorithm>

#include "core/common/field_error.h"
#include "core/common/utf8.h"

namespace polyest::internal::equations {
namespace {

constexpr size_t kMaxQuoted = 24;  // bytes

bool IsPlain(absl::string_view text) {
  return IsUtf8(text) && std::ranges::none_of(text, [](char byte) {
           return static_cast<unsigned char>(byte) < ' ' || byte == '\x7f';
         });
}

}  // namespace

std::string Quoted(std::string_view text) {
  const absl::string_view shown = CutAt({text.data(), text.size()}, kMaxQuoted);
  return absl::StrFormat("\"%s%s\"", IsPlain(shown) ? std::string(shown) : absl::CHexEscape(shown),
                         shown.size() < text.size() ? "…" : "");
}

absl::Status ErrorAt(const FieldPath& field, std::string_view text, size_t offset,
                     std::string_view message) {
  const auto begin = text.begin();
  const auto column = 1 + std::count_if(begin, begin + static_cast<std::ptrdiff_t>(offset),
                                        [](char byte) { return !ContinuesCharacter(byte); });
  const std::string where =
      offset < text.size() ? "at " + Quoted(text.substr(offset)) : std::string("at the end");
  return InvalidField(field, absl::StrFormat("column %d: %s (%s)", column, message, where));
}

}  // namespace polyest::internal::equations
