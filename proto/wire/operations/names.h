#pragma once

// Resource names, `{collection}/{id}`.

#include <absl/status/statusor.h>

#include <string>

namespace polyest::internal {

// The id in `name`; INVALID_ARGUMENT, naming `field`, when it is no name in `collection`. Whether
// the resource exists is another question.
absl::StatusOr<std::string> ResourceId(const std::string& field, const std::string& collection,
                                       const std::string& name);

}  // namespace polyest::internal
