#include "client/cpp/data/cells.h"

#include <absl/strings/ascii.h>
#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/strip.h>

#include <algorithm>

#include "client/cpp/data/text_encoding.h"
#include "core/common/utf8.h"

namespace polyest::internal {
namespace {

// No-break spaces: U+00A0, the narrow U+202F, and U+FEFF, which is also the byte order mark.
constexpr absl::string_view kSpaces[] = {"\xC2\xA0", "\xE2\x80\xAF", "\xEF\xBB\xBF"};

bool RemoveSpace(absl::string_view& text) {
  for (const absl::string_view space : kSpaces) {
    if (absl::ConsumePrefix(&text, space) || absl::ConsumeSuffix(&text, space)) return true;
  }
  return false;
}

bool IsControl(char c) { return absl::ascii_iscntrl(static_cast<unsigned char>(c)); }

size_t SkipSpaces(absl::string_view line, size_t begin, char delimiter) {
  while (begin < line.size() && line[begin] != delimiter &&
         (line[begin] == ' ' || line[begin] == '\t')) {
    ++begin;
  }
  return begin;
}

}  // namespace

absl::string_view StripCell(absl::string_view text) {
  do {
    text = absl::StripAsciiWhitespace(text);
  } while (RemoveSpace(text));
  return text;
}

std::string QuoteCell(absl::string_view cell) {
  constexpr size_t kMaxShown = 40;
  std::string shown = ToUtf8(cell);
  const size_t length = CutAt(shown, kMaxShown).size();
  const bool cut = length < shown.size();
  shown.resize(length);
  if (std::any_of(shown.begin(), shown.end(), IsControl)) shown = absl::Utf8SafeCHexEscape(shown);
  return absl::StrCat("\"", shown, cut ? "…" : "", "\"");
}

size_t CellEnd(absl::string_view line, size_t begin, char delimiter) {
  const size_t start = SkipSpaces(line, begin, delimiter);
  if (start == line.size() || line[start] != '"') {
    return std::min(line.find(delimiter, start), line.size());
  }
  size_t quote = line.find('"', start + 1);
  while (quote != absl::string_view::npos && quote + 1 < line.size() && line[quote + 1] == '"') {
    quote = line.find('"', quote + 2);
  }
  if (quote == absl::string_view::npos) return quote;
  return std::min(line.find(delimiter, quote), line.size());
}

std::string CellText(absl::string_view cell) {
  const std::string utf8 = ToUtf8(StripCell(cell));
  absl::string_view text = StripCell(utf8);
  if (!absl::ConsumePrefix(&text, "\"")) return std::string(text);
  absl::ConsumeSuffix(&text, "\"");
  return std::string(StripCell(absl::StrReplaceAll(text, {{"\"\"", "\""}})));
}

std::vector<std::string> SplitCells(absl::string_view line, char delimiter) {
  std::vector<std::string> cells;
  for (size_t begin = 0; begin <= line.size();) {
    const size_t end = std::min(CellEnd(line, begin, delimiter), line.size());
    cells.push_back(CellText(line.substr(begin, end - begin)));
    begin = end + 1;
  }
  return cells;
}

}  // namespace polyest::internal
