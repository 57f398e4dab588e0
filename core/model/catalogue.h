#pragma once

#include <absl/status/statusor.h>

#include <memory>
#include <string_view>
#include <vector>

#include "core/model/model.h"

namespace polyest {

// The built-in models, in the order of the documentation.
const std::vector<std::shared_ptr<const StateSpaceModel>>& BuiltinModels();

// NOT_FOUND, listing the names there are, for a name that is not in the catalogue.
absl::StatusOr<std::shared_ptr<const StateSpaceModel>> FindBuiltinModel(std::string_view name);

}  // namespace polyest
