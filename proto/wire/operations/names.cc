#include "proto/wire/operations/names.h"

#include <absl/strings/ascii.h>
#include <absl/strings/escaping.h>
#include <absl/strings/str_format.h>

#include <algorithm>

#include "proto/wire/convert/annotate.h"

namespace polyest::internal {

absl::StatusOr<std::string> ResourceId(const std::string& field, const std::string& collection,
                                       const std::string& name) {
  if (name.starts_with(collection + "/")) {
    std::string id = name.substr(collection.size() + 1);
    const bool plain =
        std::ranges::none_of(id, [](char c) { return c == '/' || absl::ascii_iscntrl(c); });
    if (!id.empty() && plain) return id;
  }
  return InvalidField(field, absl::StrFormat("\"%s\" must be of the form %s/{id}",
                                             absl::Utf8SafeCEscape(name), collection));
}

}  // namespace polyest::internal
