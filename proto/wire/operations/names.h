#pragma once

// Resource names, `{collection}/{id}`.

#include <absl/status/statusor.h>

#include <string>

namespace polyest::internal {

// Returns the id in `name`. Refuses a name that is not of the form `{collection}/{id}`, or has a
// control character, which databases do not take, with INVALID_ARGUMENT, naming `field`. Does not
// check whether the resource exists.
absl::StatusOr<std::string> ResourceId(const std::string& field, const std::string& collection,
                                       const std::string& name);

}  // namespace polyest::internal
