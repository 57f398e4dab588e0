#include "core/model/list_names.h"

#include <absl/strings/str_join.h>

namespace polyest::internal {

std::vector<std::string> NamesOf(const std::vector<Quantity>& quantities) {
  std::vector<std::string> names;
  for (const Quantity& quantity : quantities) names.push_back(quantity.name);
  return names;
}

std::string ListNames(const std::vector<Quantity>& quantities) {
  if (quantities.empty()) return "none";
  return absl::StrJoin(NamesOf(quantities), ", ");
}

}  // namespace polyest::internal
