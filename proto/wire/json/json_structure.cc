#include "proto/wire/json/json_structure.h"

#include <absl/container/flat_hash_set.h>
#include <absl/strings/ascii.h>
#include <absl/strings/escaping.h>
#include <absl/strings/match.h>
#include <absl/strings/numbers.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/common/utf8.h"
#include "proto/wire/json/json_field.h"
#include "proto/wire/json/json_token.h"
#include "proto/wire/json/wrong_values.h"

namespace polyest::internal {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;

// Returns a part of the text for a message, the beginning of a long one.
std::string Shown(absl::string_view text) {
  constexpr size_t kMaxShown = 60;
  const absl::string_view beginning = CutAt(text, kMaxShown);
  return absl::StrCat(ValidUtf8(absl::Utf8SafeCHexEscape(beginning)),
                      beginning.size() < text.size() ? "…" : "");
}

// Returns a token for a message, a text with its quotes.
std::string ShownToken(absl::string_view token) {
  if (token.front() != '"') return Shown(token);
  return token.size() < 2 ? "\""
                          : absl::StrCat("\"", Shown(token.substr(1, token.size() - 2)), "\"");
}

// What may come next.
enum class Next { kValue, kValueOrEnd, kName, kNameOrEnd, kColon, kCommaOrEnd, kNothing };

class Scan {
 public:
  Scan(absl::string_view json, const Descriptor& type) : json_(json), type_(type) {}

  std::optional<JsonError> Run() {
    for (SkipSpace(); at_ < json_.size(); SkipSpace()) {
      if (auto error = TakeToken()) return error;
    }
    if (next_ == Next::kNothing) return std::nullopt;
    if (open_.empty()) return Error(at_, "a JSON object must stand here");
    const JsonError bracket = Error(open_.back().at, "");
    return Error(
        at_, absl::StrCat("the text ends before the ", open_.back().is_object ? "{" : "[",
                          " of line ", bracket.line, ", column ", bracket.column, " is closed"));
  }

 private:
  // An object or an array that is open.
  struct Open {
    bool is_object;
    size_t at;                                     // of its bracket
    absl::flat_hash_set<absl::string_view> names;  // of an object's fields so far
    absl::string_view name;                        // of the field whose value is being read
    size_t index = 0;                              // of the element being read
  };

  void SkipSpace() {
    const auto is_space = [](char c) { return c == ' ' || c == '\n' || c == '\r' || c == '\t'; };
    while (at_ < json_.size() && is_space(json_[at_])) ++at_;
  }

  std::optional<JsonError> TakeToken() {
    switch (json_[at_]) {
      case '{':
      case '[':
        return TakeOpening();
      case '}':
      case ']':
        return TakeClosing();
      case ',':
        return TakeComma();
      case ':':
        if (next_ != Next::kColon) return Unexpected();
        next_ = Next::kValue;
        ++at_;
        return std::nullopt;
      case '"':
        return TakeText();
      default:
        return TakeWord();
    }
  }

  bool ExpectsName() const { return next_ == Next::kName || next_ == Next::kNameOrEnd; }
  bool ExpectsValue() const { return next_ == Next::kValue || next_ == Next::kValueOrEnd; }
  void EndValue() { next_ = open_.empty() ? Next::kNothing : Next::kCommaOrEnd; }

  std::optional<JsonError> TakeOpening() {
    if (!ExpectsValue()) return Unexpected();
    if (open_.size() == kMaxJsonDepth) {
      return Error(at_, absl::StrCat("brackets are nested more than ", kMaxJsonDepth, " deep"));
    }
    const bool is_object = json_[at_] == '{';
    open_.push_back({.is_object = is_object, .at = at_++, .names = {}, .name = {}});
    next_ = is_object ? Next::kNameOrEnd : Next::kValueOrEnd;
    return std::nullopt;
  }

  std::optional<JsonError> TakeClosing() {
    const bool complete =
        next_ == Next::kNameOrEnd || next_ == Next::kValueOrEnd || next_ == Next::kCommaOrEnd;
    if (!complete || open_.back().is_object != (json_[at_] == '}')) return Unexpected();
    ++at_;
    open_.pop_back();
    EndValue();
    return std::nullopt;
  }

  std::optional<JsonError> TakeComma() {
    if (next_ != Next::kCommaOrEnd) return Unexpected();
    comma_ = at_++;
    if (!open_.back().is_object) ++open_.back().index;
    next_ = open_.back().is_object ? Next::kName : Next::kValue;
    return std::nullopt;
  }

  std::optional<JsonError> TakeText() {
    if (!ExpectsName() && !ExpectsValue()) return Unexpected();
    const size_t begin = at_;
    const JsonToken text = TextToken(json_, begin);
    if (!text.rule.empty()) return Error(text.wrong, text.rule);
    at_ = text.end;
    if (ExpectsValue()) {
      EndValue();
      return std::nullopt;
    }
    Open& object = open_.back();
    object.name = json_.substr(begin + 1, text.end - begin - 2);
    if (!object.names.insert(object.name).second) return FieldError(begin, "given twice");
    next_ = Next::kColon;
    return std::nullopt;
  }

  std::optional<JsonError> TakeWord() {
    const absl::string_view word = WordAt(json_, at_);
    if (!ExpectsValue() || word.empty()) return Unexpected();
    if (IsJsonNumber(word)) {
      if (!IsInRange(word)) {
        return Error(at_, absl::StrCat(Shown(word), " is beyond the range of a number"));
      }
    } else if (word == "null") {
      const std::string refusal = RefusalOfNullHere();
      if (!refusal.empty()) return FieldError(at_, refusal);
    } else if (word != "true" && word != "false") {
      return Unexpected();
    }
    at_ += word.size();
    EndValue();
    return std::nullopt;
  }

  // Returns why null must not stand here; an empty text if it may.
  std::string RefusalOfNullHere() const {
    if (open_.empty()) return "";
    if (!open_.back().is_object) return "must be a value, not null";
    const FieldDescriptor* const field = FieldHere();
    return field == nullptr ? "" : RefusalOfNull(*field);
  }

  // Returns the field whose value is being read; null if the type does not have it.
  const FieldDescriptor* FieldHere() const {
    const FieldDescriptor* field = nullptr;
    for (const Open& open : open_) {
      if (!open.is_object) {
        if (field == nullptr) return nullptr;  // the elements of a list have its field
      } else if (field != nullptr && field->is_map()) {
        field = field->message_type()->map_value();
      } else {
        const Descriptor* const message = field == nullptr ? &type_ : field->message_type();
        // Messages such as Duration have a special JSON form.
        if (message == nullptr || absl::StartsWith(message->full_name(), "google.protobuf.")) {
          return nullptr;
        }
        field = FindField(*message, open.name);
        if (field == nullptr) return nullptr;
      }
    }
    return field;
  }

  // Returns what is wrong with the token, which must not stand here.
  JsonError Unexpected() const {
    const char c = json_[at_];
    const absl::string_view rest = json_.substr(at_, 2);
    if (c == '\'') return Error(at_, "names and texts stand in double quotes, not in single ones");
    if (c == '#' || rest == "//" || rest == "/*") return Error(at_, "JSON has no comments");
    const bool after_comma = next_ == Next::kName ||
                             (next_ == Next::kValue && !open_.empty() && !open_.back().is_object);
    if (after_comma && (c == '}' || c == ']')) {
      return Error(comma_, "no comma may follow the last value");
    }
    return Error(at_, RuleHere(ShownToken(TokenAt(json_, at_))));
  }

  // Returns what must be here in place of `token`.
  std::string RuleHere(const std::string& token) const {
    const bool is_word = !WordAt(json_, at_).empty();
    const char first = token.front();
    switch (next_) {
      case Next::kName:
      case Next::kNameOrEnd:
        if (is_word) return absl::StrCat("the name ", token, " must stand in double quotes");
        return absl::StrCat("a name in double quotes must stand here, not ", token);
      case Next::kColon:
        return absl::StrCat("a colon must follow the name \"", Shown(open_.back().name), "\", not ",
                            token);
      case Next::kCommaOrEnd:
        return absl::StrCat("a comma or ", open_.back().is_object ? "}" : "]",
                            " must stand before ", token);
      case Next::kNothing:
        return absl::StrCat("nothing may follow the end of the JSON text, but ", token, " does");
      case Next::kValue:
      case Next::kValueOrEnd:
        break;
    }
    if (!is_word) return absl::StrCat("a value must stand here, not ", token);
    if (absl::ascii_isdigit(static_cast<unsigned char>(first)) || first == '+' || first == '-' ||
        first == '.') {
      return absl::StrCat(token, " is no number of JSON");
    }
    return absl::StrCat(token,
                        " is no value of JSON, which has numbers, true, false, null, texts in "
                        "double quotes, [ ] and { }");
  }

  // Returns where the scan is: "uncertain[0].uniform.lower".
  std::string Path() const {
    std::string path;
    for (const Open& open : open_) {
      if (open.is_object) {
        absl::StrAppend(&path, path.empty() ? "" : ".", Shown(open.name));
      } else {
        absl::StrAppend(&path, "[", open.index, "]");
      }
    }
    return path;
  }

  JsonError FieldError(size_t at, std::string rule) const {
    JsonError error = Error(at, std::move(rule));
    error.field = Path();
    return error;
  }

  JsonError Error(size_t at, std::string rule) const {
    const absl::string_view before = json_.substr(0, at);
    const size_t line_end = before.rfind('\n');
    const absl::string_view line =
        line_end == absl::string_view::npos ? before : before.substr(line_end + 1);
    const auto characters =
        std::count_if(line.begin(), line.end(), [](char c) { return !ContinuesCharacter(c); });
    return {.line = 1 + std::count(before.begin(), before.end(), '\n'),
            .column = 1 + characters,
            .field = "",
            .rule = std::move(rule)};
  }

  const absl::string_view json_;
  const Descriptor& type_;
  size_t at_ = 0;
  size_t comma_ = 0;  // the place of the last comma
  Next next_ = Next::kValue;
  std::vector<Open> open_;
};

}  // namespace

std::optional<JsonError> CheckJsonStructure(absl::string_view json, const Descriptor& type) {
  return Scan(json, type).Run();
}

}  // namespace polyest::internal
