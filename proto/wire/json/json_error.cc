#include "proto/wire/json/json_error.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/strip.h>

namespace polyest::internal {

// Rewrites the parser's "(uncertain[0].uniform) lower: …" as "uncertain[0].uniform.lower: …".
std::string DescribeParserMessage(absl::string_view message) {
  message = message.substr(0, message.find('\n'));
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

}  // namespace polyest::internal
