#pragma once

// The built-in models: oscillators, a pendulum, a bicycle, quarter and half cars.

#include <absl/status/statusor.h>

#include <memory>
#include <string_view>
#include <vector>

#include "polyest/model.h"

namespace polyest {

// Returns the built-in models, in the order of the documentation.
const std::vector<std::shared_ptr<const StateSpaceModel>>& BuiltinModels();

// Returns the built-in model of this name; NOT_FOUND lists the names there are.
absl::StatusOr<std::shared_ptr<const StateSpaceModel>> FindBuiltinModel(std::string_view name);

}  // namespace polyest
