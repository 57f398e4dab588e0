#include "proto/wire/json/json_structure.h"

#include <absl/container/flat_hash_set.h>
#include <absl/strings/ascii.h>
#include <absl/strings/escaping.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

namespace polyest::internal {
namespace {

// Returns a name for a message, the beginning of a long one. What is not ASCII, and perhaps not
// even UTF-8, is escaped.
std::string Shown(absl::string_view name) {
  constexpr size_t kMaxShown = 60;
  if (name.size() <= kMaxShown) return absl::CHexEscape(name);
  return absl::StrCat(absl::CHexEscape(name.substr(0, kMaxShown)), "…");
}

class Scan {
 public:
  explicit Scan(absl::string_view json) : json_(json) {}

  std::optional<JsonError> Run() {
    while (at_ < json_.size()) {
      const char c = json_[at_];
      if (c == '"' || c == '\'') {
        TakeString(c);
      } else if (IsOfWord(c)) {
        TakeWord();
        if (text_ == "null" && !open_.empty() && !open_.back().is_object) {
          return Error(Path() + ": must be a value, not null");
        }
      } else {
        ++at_;
        if (auto error = TakeSign(c)) return error;
      }
    }
    return std::nullopt;
  }

 private:
  // An object or an array that is open.
  struct Open {
    bool is_object;
    absl::flat_hash_set<absl::string_view> names;  // of an object's fields so far
    absl::string_view name;                        // of the field whose value is being read
    size_t index = 0;                              // of the element being read
  };

  static bool IsOfWord(char c) {
    return absl::ascii_isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '$';
  }

  // Takes a string with its quotes. One that does not end takes the rest of the text.
  void TakeString(char quote) {
    const size_t begin = ++at_;
    while (at_ < json_.size() && json_[at_] != quote) at_ += json_[at_] == '\\' ? 2 : 1;
    at_ = std::min(at_, json_.size());
    text_ = json_.substr(begin, at_ - begin);
    if (at_ < json_.size()) ++at_;
  }

  void TakeWord() {
    const size_t begin = at_;
    while (at_ < json_.size() && IsOfWord(json_[at_])) ++at_;
    text_ = json_.substr(begin, at_ - begin);
  }

  std::optional<JsonError> TakeSign(char c) {
    if (c == '{' || c == '[') {
      if (open_.size() == kMaxJsonDepth) {
        return Error(absl::StrCat("brackets are nested more than ", kMaxJsonDepth, " deep"));
      }
      open_.push_back({.is_object = c == '{', .names = {}, .name = {}});
    } else if (open_.empty()) {
      return std::nullopt;
    } else if (c == '}' || c == ']') {
      open_.pop_back();
    } else if (c == ',' && !open_.back().is_object) {
      ++open_.back().index;
    } else if (c == ':' && open_.back().is_object) {
      open_.back().name = text_;
      if (!open_.back().names.insert(text_).second) return Error(Path() + ": given twice");
    }
    return std::nullopt;
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

  JsonError Error(std::string what) const {
    const auto end = json_.begin() + static_cast<std::ptrdiff_t>(at_);
    return {1 + std::count(json_.begin(), end, '\n'), std::move(what)};
  }

  const absl::string_view json_;
  size_t at_ = 0;
  absl::string_view text_;  // the last string, without its quotes, or word
  std::vector<Open> open_;
};

}  // namespace

std::optional<JsonError> CheckJsonStructure(absl::string_view json) { return Scan(json).Run(); }

}  // namespace polyest::internal
