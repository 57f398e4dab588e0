#pragma once

// Opens the folders of models that an operator or a user names.

#include <absl/status/statusor.h>

#include <string>

#include "core/external/model_library.h"

namespace polyest::internal {

// Names of folders; empty: none.
struct ModelFolders {
  std::string fmus;      // --fmu-dir
  std::string umbridge;  // --umbridge-dir
};

// Returns the built-in models and those of the folders. Returns NotFound that begins with the
// option if a folder cannot be read.
absl::StatusOr<ModelLibrary> OpenModels(const ModelFolders& folders);

}  // namespace polyest::internal
