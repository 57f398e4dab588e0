#include "core/fmu/fmu_folder.h"

#include "core/fmu/fmu_model.h"

namespace polyest::internal {

ModelFileKind FmuFiles(const WorkerLimits& limits) {
  return {
      .noun = "FMU",
      .suffix = ".fmu",
      .read = [limits](const std::filesystem::path& file,
                       const std::string& name) -> absl::StatusOr<std::shared_ptr<const Model>> {
        return FmuModel::Read(file, name, limits);
      }};
}

}  // namespace polyest::internal
