#include "proto/wire/operations/names.h"

#include <absl/strings/str_format.h>

#include "proto/wire/convert/annotate.h"

namespace polyest::internal {

absl::StatusOr<std::string> ResourceId(const std::string& field, const std::string& collection,
                                       const std::string& name) {
  if (name.starts_with(collection + "/")) {
    std::string id = name.substr(collection.size() + 1);
    if (!id.empty() && id.find('/') == std::string::npos) return id;
  }
  return InvalidField(field,
                      absl::StrFormat("\"%s\" must be of the form %s/{id}", name, collection));
}

}  // namespace polyest::internal
