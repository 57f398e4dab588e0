#pragma once

// The folder of the usable FMUs.

#include "core/external/model_folder.h"
#include "core/fmu/worker_process.h"

namespace polyest::internal {

// Returns the files that a folder of FMUs has, NAME.fmu.
ModelFileKind FmuFiles(const WorkerLimits& limits = {});

}  // namespace polyest::internal
