#include "core/umbridge/open_models.h"

#include <absl/strings/str_cat.h>

#include <optional>
#include <utility>

#include "core/common/status.h"
#include "core/fmu/fmu_folder.h"
#include "core/umbridge/umbridge_folder.h"

namespace polyest::internal {
namespace {

absl::StatusOr<std::optional<ModelFolder>> OpenIfNamed(const std::string& folder,
                                                       const char* option, ModelFileKind kind) {
  if (folder.empty()) return std::nullopt;
  absl::StatusOr<ModelFolder> opened = ModelFolder::Open(folder, std::move(kind));
  if (opened.ok()) return *std::move(opened);
  return absl::Status(opened.status().code(),
                      absl::StrCat(option, ": ", opened.status().message()));
}

}  // namespace

absl::StatusOr<ModelLibrary> OpenModels(const ModelFolders& folders) {
  POLYEST_ASSIGN_OR_RETURN(std::optional<ModelFolder> fmus,
                           OpenIfNamed(folders.fmus, "--fmu-dir", FmuFiles()));
  POLYEST_ASSIGN_OR_RETURN(std::optional<ModelFolder> umbridge,
                           OpenIfNamed(folders.umbridge, "--umbridge-dir", UmBridgeFiles()));
  return ModelLibrary(std::move(fmus), std::move(umbridge));
}

}  // namespace polyest::internal
