#pragma once

#include "core/model/model.h"
#include "polyest/v1/estimation_service.pb.h"

namespace polyest {

// Named `models/{name}`.
v1::Model ToProto(const Model& model);

}  // namespace polyest
