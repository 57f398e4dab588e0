#include "proto/wire/json/json_error.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/strip.h>

#include <algorithm>

namespace polyest::internal {
namespace {

// Returns the line of a syntax error, or 0 when it is not known. The parser's message has three
// parts: the error, the text around it, and a caret under the position. The line is known if that
// text occurs only once.
int64_t LineOf(absl::string_view json, absl::string_view message) {
  const size_t first = message.find('\n');
  const size_t last = message.rfind('\n');
  if (first == absl::string_view::npos || last == first) return 0;
  const absl::string_view around = message.substr(first + 1, last - first - 1);
  const size_t start = around.empty() ? json.size() : json.find(around);
  if (start == absl::string_view::npos) return 0;
  if (!around.empty() && json.find(around, start + 1) != absl::string_view::npos) return 0;
  const size_t caret = std::min(start + message.size() - last - 2, json.size());
  return 1 + std::count(json.begin(), json.begin() + static_cast<std::ptrdiff_t>(caret), '\n');
}

// Rewrites the parser's "(uncertain[0].uniform) lower: …" as "uncertain[0].uniform.lower: …".
std::string FieldMessage(absl::string_view message) {
  absl::ConsumePrefix(&message, ": ");
  std::string text(message);
  if (absl::ConsumePrefix(&message, "(")) {
    const size_t close = message.find(')');
    if (close != absl::string_view::npos) {
      absl::string_view rest = message.substr(close + 1);
      const bool member = absl::ConsumePrefix(&rest, " ");
      text = absl::StrCat(message.substr(0, close), member ? "." : "", rest);
    }
  }
  return absl::StrReplaceAll(
      text, {{"type.googleapis.com/polyest.v1.", ""},
             {"Root element must be a message.", "the file must hold one JSON object"}});
}

}  // namespace

JsonError DescribeJsonError(absl::string_view json, absl::string_view message) {
  return {LineOf(json, message), FieldMessage(message.substr(0, message.find('\n')))};
}

}  // namespace polyest::internal
