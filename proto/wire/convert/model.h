#pragma once

#include "polyest/model.h"
#include "polyest/v1/model_service.pb.h"

namespace polyest::internal {

// Converts the description of a model. Its resource name is `models/{name}`.
v1::Model ToProto(const Model& model);

}  // namespace polyest::internal
