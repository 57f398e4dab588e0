#include "client/cli/name_list.h"

namespace polyest::internal {

std::vector<std::string> SplitNames(absl::string_view list) {
  std::vector<std::string> names(1);
  int open = 0;  // brackets
  for (const char c : list) {
    if (c == '[' || c == '(') ++open;
    if ((c == ']' || c == ')') && open > 0) --open;
    if (c == ',' && open == 0) {
      names.emplace_back();
    } else {
      names.back() += c;
    }
  }
  return names;
}

}  // namespace polyest::internal
