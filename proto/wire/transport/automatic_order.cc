#include "proto/wire/transport/automatic_order.h"

#include <cstddef>
#include <vector>

namespace polyest::internal {
namespace {

constexpr absl::string_view kAutomatic = "\"AUTO\"";
constexpr absl::string_view kNull = "null  ";

// Walks through JSON text and keeps track of the objects and members around each string.
class Walk {
 public:
  explicit Walk(absl::string_view json) : json_(json) {}

  // Returns the position of the value "AUTO" of expansion.order; npos if it is not there.
  size_t Find() {
    for (size_t at = 0; at < json_.size();) {
      const char c = json_[at];
      if (c == '"') {
        const size_t end = EndOfString(at);
        if (end == absl::string_view::npos) break;
        if (IsAutomaticOrder(json_.substr(at, end - at))) return at;
        Take(json_.substr(at, end - at));
        at = end;
        continue;
      }
      if (c == '{' || c == '[') open_.push_back({c == '{', true, {}});
      if ((c == '}' || c == ']') && !open_.empty()) open_.pop_back();
      if (c == ',' && !open_.empty()) open_.back().at_name = true;
      if (c == ':' && !open_.empty()) open_.back().at_name = false;
      ++at;
    }
    return absl::string_view::npos;
  }

 private:
  struct Open {
    bool object;
    bool at_name;            // the next string is a member's name
    absl::string_view name;  // of the member, with its quotes
  };

  // Returns the position just after the string that begins at `at`; npos if it does not end.
  size_t EndOfString(size_t at) const {
    for (size_t i = at + 1; i < json_.size(); ++i) {
      if (json_[i] == '\\') {
        ++i;
      } else if (json_[i] == '"') {
        return i + 1;
      }
    }
    return absl::string_view::npos;
  }

  void Take(absl::string_view text) {
    if (!open_.empty() && open_.back().object && open_.back().at_name) open_.back().name = text;
  }

  bool IsAutomaticOrder(absl::string_view text) const {
    return text == kAutomatic && open_.size() == 2 && open_[0].name == "\"expansion\"" &&
           open_[1].object && !open_[1].at_name && open_[1].name == "\"order\"";
  }

  const absl::string_view json_;
  std::vector<Open> open_;
};

}  // namespace

std::string WithoutAutomaticOrder(absl::string_view json) {
  std::string text(json);
  const size_t at = Walk(json).Find();
  if (at != absl::string_view::npos)
    text.replace(at, kAutomatic.size(), kNull.data(), kNull.size());
  return text;
}

}  // namespace polyest::internal
