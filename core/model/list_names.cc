#include "core/model/list_names.h"

#include <absl/strings/str_join.h>

namespace polyest::internal {

std::string ListNames(const std::vector<Quantity>& quantities) {
  if (quantities.empty()) return "none";
  return absl::StrJoin(quantities, ", ", [](std::string* text, const Quantity& quantity) {
    text->append(quantity.name);
  });
}

}  // namespace polyest::internal
