#include "core/umbridge/umbridge_folder.h"

#include "core/umbridge/umbridge_model.h"

namespace polyest::internal {

ModelFileKind UmBridgeFiles() {
  return {.noun = "UM-Bridge model",
          .suffix = ".umbridge.json",
          .read = [](const std::filesystem::path& file,
                     const std::string& name) -> absl::StatusOr<std::shared_ptr<const Model>> {
            return UmBridgeModel::Read(file, name);
          }};
}

}  // namespace polyest::internal
