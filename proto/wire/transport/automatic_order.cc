#include "proto/wire/transport/automatic_order.h"

#include <cstddef>
#include <vector>

namespace polyest::internal {
namespace {

constexpr absl::string_view kAutomatic = "\"AUTO\"";
constexpr absl::string_view kNull = "null  ";
// The parser refuses text that is deeper.
constexpr size_t kMaxDepth = 200;

// Walks through JSON text and keeps track of the objects and members around each string.
class Walk {
 public:
  // `anywhere` says whether the expansion may belong to an inner object, too.
  Walk(absl::string_view json, bool anywhere) : json_(json), anywhere_(anywhere) {}

  // Returns the positions of the values "AUTO" of expansion.order.
  std::vector<size_t> Find() {
    std::vector<size_t> found;
    for (size_t at = 0; at < json_.size();) {
      const char c = json_[at];
      if (c == '"') {
        const size_t end = EndOfString(at);
        if (end == absl::string_view::npos) break;
        if (IsAutomaticOrder(json_.substr(at, end - at))) found.push_back(at);
        Take(json_.substr(at, end - at));
        at = end;
        continue;
      }
      if (c == '{' || c == '[') open_.push_back({c == '{', true, {}});
      if (open_.size() > kMaxDepth) break;
      if ((c == '}' || c == ']') && !open_.empty()) open_.pop_back();
      if (c == ',' && !open_.empty()) open_.back().at_name = true;
      if (c == ':' && !open_.empty()) open_.back().at_name = false;
      ++at;
    }
    return found;
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
    const size_t depth = open_.size();
    return text == kAutomatic && depth >= 2 && (anywhere_ || depth == 2) &&
           open_[depth - 2].name == "\"expansion\"" && open_.back().object &&
           !open_.back().at_name && open_.back().name == "\"order\"";
  }

  const absl::string_view json_;
  const bool anywhere_;
  std::vector<Open> open_;
};

std::string Without(absl::string_view json, bool anywhere) {
  std::string text(json);
  for (const size_t at : Walk(json, anywhere).Find()) {
    text.replace(at, kAutomatic.size(), kNull.data(), kNull.size());
  }
  return text;
}

}  // namespace

std::string WithoutAutomaticOrder(absl::string_view json) { return Without(json, false); }

std::string WithoutAutomaticOrders(absl::string_view json) { return Without(json, true); }

}  // namespace polyest::internal
