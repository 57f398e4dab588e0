#include "proto/wire/json/json_structure.h"

#include <absl/container/flat_hash_set.h>
#include <absl/strings/escaping.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>
#include <vector>

#include "core/common/utf8.h"
#include "proto/wire/json/json_field.h"
#include "proto/wire/json/wrong_values.h"

namespace polyest::internal {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using Json = nlohmann::json;

// Returns a name for a message, the beginning of a long one.
std::string Shown(absl::string_view name) {
  constexpr size_t kMaxShown = 60;
  const absl::string_view beginning = CutAt(name, kMaxShown);
  return absl::StrCat(absl::Utf8SafeCHexEscape(beginning),
                      beginning.size() < name.size() ? "…" : "");
}

// Returns what the parser says without its number and the place, which it counts in bytes, and not
// all of a long text that it repeats.
std::string RuleOf(absl::string_view what) {
  constexpr size_t kMaxRule = 200;
  const size_t place = what.find(", column ");
  const absl::string_view before = place == what.npos ? "] " : ": ";
  const size_t begin = what.find(before, place == what.npos ? 0 : place);
  if (begin != what.npos) what.remove_prefix(begin + before.size());
  const absl::string_view beginning = CutAt(what, kMaxRule);
  return ValidUtf8(absl::StrCat(beginning, beginning.size() < what.size() ? "…" : ""));
}

// Reads a text and tells how far it has been read, which the parser's events do not say.
class Cursor {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  // Copies share `read`.
  Cursor(absl::string_view text, size_t& read) : text_(text.data()), read_(&read) {}

  reference operator*() const { return text_[*read_]; }
  Cursor& operator++() {
    ++*read_;
    return *this;
  }
  bool operator==(const Cursor& other) const { return *read_ == *other.read_; }

 private:
  const char* text_;
  size_t* read_;
};

// Takes the parser's events, whose names are the library's. An event returns whether to go on.
class Events {
 public:
  Events(absl::string_view json, const Descriptor& type) : json_(json), type_(type) {}

  std::optional<JsonError> Run() {
    size_t end = json_.size();
    Json::sax_parse(Cursor(json_, read_), Cursor(json_, end), this);
    return std::move(error_);
  }

  bool null() {
    Begin();
    const std::string refusal = RefusalOfNullHere();
    constexpr size_t kLength = 4;
    return refusal.empty() || StopAt(read_ - kLength, Path(), refusal);
  }
  bool boolean(bool) { return Begin(); }
  bool number_integer(Json::number_integer_t) { return Begin(); }
  bool number_unsigned(Json::number_unsigned_t) { return Begin(); }
  bool number_float(Json::number_float_t, const std::string&) { return Begin(); }
  bool string(std::string&) { return Begin(); }
  bool binary(Json::binary_t&) { return Begin(); }
  bool start_object(size_t) { return Open(/*is_object=*/true); }
  bool start_array(size_t) { return Open(/*is_object=*/false); }
  bool end_object() { return Close(); }
  bool end_array() { return Close(); }

  bool key(std::string& name) {
    Bracket& object = open_.back();
    object.name = name;
    if (object.names.insert(name).second) return true;
    return StopAt(json_.rfind('"', read_ - 2), Path(), "given twice");
  }

  bool parse_error(size_t position, const std::string&, const Json::exception& error) {
    const size_t at = std::min(position, json_.size() + 1) - 1;
    return StopAt(at, "", absl::StrCat(RuleOf(error.what()), HintAt(at)));
  }

 private:
  // An object or an array that is open.
  struct Bracket {
    bool is_object;
    absl::flat_hash_set<std::string> names;  // of an object's fields so far
    std::string name;                        // of the field whose value is being read
    int64_t index = -1;                      // of the element being read
  };

  bool Begin() {
    if (!open_.empty()) ++open_.back().index;
    return true;
  }

  bool Open(bool is_object) {
    Begin();
    if (open_.size() == kMaxJsonDepth) {
      return StopAt(read_ - 1, "",
                    absl::StrCat("brackets are nested more than ", kMaxJsonDepth, " deep"));
    }
    open_.push_back({.is_object = is_object, .names = {}, .name = {}});
    return true;
  }

  bool Close() {
    open_.pop_back();
    return true;
  }

  // Returns what to do about a usual mistake, at the place where the parser has found it.
  absl::string_view HintAt(size_t at) const {
    const char found = at < json_.size() ? json_[at] : ' ';
    const size_t before = json_.substr(0, at).find_last_not_of(" \t\r\n");
    const bool after_comma = before != json_.npos && json_[before] == ',';
    if (found == '\'') return "; names and texts stand in double quotes";
    if (found == '#' || found == '/') return "; JSON has no comments";
    if ((found == '}' || found == ']') && after_comma)
      return "; no comma may follow the last value";
    return "";
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
    for (const Bracket& open : open_) {
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

  // Returns where the parser is: "uncertain[0].uniform.lower".
  std::string Path() const {
    std::string path;
    for (const Bracket& open : open_) {
      if (open.is_object) {
        absl::StrAppend(&path, path.empty() ? "" : ".", Shown(open.name));
      } else {
        absl::StrAppend(&path, "[", open.index, "]");
      }
    }
    return path;
  }

  // Notes what is wrong at a place of the text, and returns that the parser must not go on.
  bool StopAt(size_t at, const std::string& field, const std::string& rule) {
    const absl::string_view before = json_.substr(0, at);
    const size_t line_end = before.rfind('\n');
    const absl::string_view line =
        line_end == absl::string_view::npos ? before : before.substr(line_end + 1);
    const auto characters =
        std::count_if(line.begin(), line.end(), [](char c) { return !ContinuesCharacter(c); });
    error_ = {.line = 1 + std::count(before.begin(), before.end(), '\n'),
              .column = 1 + characters,
              .field = field,
              .rule = rule};
    return false;
  }

  const absl::string_view json_;
  const Descriptor& type_;
  size_t read_ = 0;
  std::vector<Bracket> open_;
  std::optional<JsonError> error_;
};

}  // namespace

std::optional<JsonError> CheckJsonStructure(absl::string_view json, const Descriptor& type) {
  return Events(json, type).Run();
}

}  // namespace polyest::internal
