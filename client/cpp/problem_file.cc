#include "client/cpp/problem_file.h"

#include <absl/status/status.h>
#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_replace.h>
#include <absl/strings/strip.h>
#include <google/protobuf/util/json_util.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "client/cpp/field_names.h"
#include "core/common/status.h"

namespace polyest {
namespace {

constexpr size_t kLongestFile = size_t{16} << 20;

// The parser's message of a syntax error has three parts: what is wrong, the text around it, and a
// caret under the place. Where that text occurs once, it tells the line; otherwise 0.
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

// "(uncertain[0]) unifrm: Cannot find field." reads better as "uncertain[0].unifrm: …".
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
  absl::string_view path = text;
  if (absl::ConsumeSuffix(&path, ": Cannot find field.")) {
    const std::string suggestion = SuggestFieldName(path);
    return absl::StrCat(path, ": there is no field of this name",
                        suggestion.empty() ? "" : absl::StrCat("; ", suggestion));
  }
  return absl::StrReplaceAll(
      text, {{"type.googleapis.com/polyest.v1.", ""},
             {"Root element must be a message.", "the file must hold one JSON object"}});
}

absl::Status ParseError(absl::string_view json, absl::string_view name, absl::string_view message) {
  const int64_t line = LineOf(json, message);
  const std::string what = FieldMessage(message.substr(0, message.find('\n')));
  if (line == 0) return absl::InvalidArgumentError(absl::StrCat(name, ": ", what));
  return absl::InvalidArgumentError(absl::StrCat(name, ":", line, ": ", what));
}

}  // namespace

absl::StatusOr<v1::Problem> ParseProblem(absl::string_view json, absl::string_view name) {
  if (absl::StripAsciiWhitespace(json).empty()) {
    return absl::InvalidArgumentError(
        absl::StrCat(name, ": is empty; it must hold one JSON object, the problem"));
  }
  v1::Problem problem;
  google::protobuf::util::JsonParseOptions options;
  options.ignore_unknown_fields = false;
  const auto status =
      google::protobuf::util::JsonStringToMessage({json.data(), json.size()}, &problem, options);
  if (!status.ok()) {
    return ParseError(json, name, {status.message().data(), status.message().size()});
  }
  return problem;
}

absl::StatusOr<v1::Problem> ReadProblemFile(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  if (!in) {
    return absl::InvalidArgumentError(
        absl::StrCat(path, ": cannot be opened: ", std::strerror(errno)));
  }
  std::string json(kLongestFile + 1, '\0');
  in.read(json.data(), static_cast<std::streamsize>(json.size()));
  if (in.bad()) return absl::InvalidArgumentError(absl::StrCat(path, ": cannot be read"));
  json.resize(static_cast<size_t>(in.gcount()));
  if (json.size() > kLongestFile) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": is longer than 16 MiB"));
  }
  return ParseProblem(json, path);
}

}  // namespace polyest
