#pragma once

// The folder of descriptions of models of UM-Bridge servers.

#include "core/external/model_folder.h"

namespace polyest::internal {

// Returns the files that such a folder has, NAME.umbridge.json.
ModelFileKind UmBridgeFiles();

}  // namespace polyest::internal
