#include "core/common/nearest_name.h"

#include <absl/strings/ascii.h>
#include <absl/strings/match.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_join.h>
#include <absl/strings/string_view.h>

#include <algorithm>

namespace polyest::internal {
namespace {

// Longer words are cut: the distance takes time proportional to the product of both lengths.
constexpr size_t kMaxWordLength = 64;
// A shorter beginning stands for too many names.
constexpr size_t kMinBeginning = 3;

// Counts the letters to insert, delete, change or swap with their neighbour to make one word of the
// other.
size_t Distance(absl::string_view a, absl::string_view b) {
  std::vector<std::vector<size_t>> distance(a.size() + 1, std::vector<size_t>(b.size() + 1));
  for (size_t i = 0; i <= a.size(); ++i) {
    for (size_t j = 0; j <= b.size(); ++j) {
      if (i == 0 || j == 0) {
        distance[i][j] = i + j;
        continue;
      }
      const size_t change = a[i - 1] == b[j - 1] ? 0 : 1;
      distance[i][j] = std::min(
          {distance[i - 1][j] + 1, distance[i][j - 1] + 1, distance[i - 1][j - 1] + change});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1]) {
        distance[i][j] = std::min(distance[i][j], distance[i - 2][j - 2] + 1);
      }
    }
  }
  return distance[a.size()][b.size()];
}

}  // namespace

std::string NearestName(const std::string& word, const std::vector<std::string>& known) {
  const std::string wrong = absl::AsciiStrToLower(word.substr(0, kMaxWordLength));
  const std::string* nearest = nullptr;
  size_t least = 0;
  for (const std::string& name : known) {
    const size_t distance = Distance(wrong, absl::AsciiStrToLower(name));
    // A third of the letters wrong is a slip; more is another word.
    if (3 * distance > name.size() || (nearest != nullptr && distance >= least)) continue;
    nearest = &name;
    least = distance;
  }
  if (nearest != nullptr) return *nearest;
  if (wrong.size() < kMinBeginning) return "";
  for (const std::string& name : known) {
    if (absl::StartsWithIgnoreCase(name, wrong)) return name;
  }
  return "";
}

std::string SuggestName(const std::string& word, const std::vector<std::string>& known) {
  if (known.empty()) return "";
  const std::string nearest = NearestName(word, known);
  if (!nearest.empty()) return absl::StrCat("did you mean \"", nearest, "\"?");
  return absl::StrCat("known names: ", absl::StrJoin(known, ", "));
}

}  // namespace polyest::internal
