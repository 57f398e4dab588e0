#pragma once

// An FMU as a model that simulates itself, in processes of its own.

#include <absl/status/status.h>

#include <filesystem>
#include <memory>
#include <mutex>
#include <string>

#include "core/fmu/fmu_description.h"
#include "core/fmu/temporary_folder.h"
#include "core/fmu/worker_process.h"
#include "core/propagation/trajectory_ensemble.h"

namespace polyest::internal {

struct UnpackedFmu {
  FmuDescription description;
  absl::Status status;  // why it could not be unpacked
  std::unique_ptr<TemporaryFolder> folder;
};

class FmuModel final : public SelfPropagatingModel {
 public:
  // Reads what the archive says of itself; nothing of the FMU is run. FAILED_PRECONDITION says
  // what is wrong with it.
  static absl::StatusOr<std::shared_ptr<const FmuModel>> Read(const std::filesystem::path& file,
                                                              const std::string& name,
                                                              const WorkerLimits& limits);

  const ModelDescription& description() const override { return description_.model; }
  const FmuInterface& interface() const { return description_.interface; }

  // An FMU that cannot be run fails the first Advance of the ensemble: FAILED_PRECONDITION.
  std::unique_ptr<TrajectoryEnsemble> StartEnsemble(EnsembleSpecification specification,
                                                    const InputSignals* inputs) const override;

 private:
  FmuModel(std::filesystem::path file, FmuDescription description, const WorkerLimits& limits)
      : file_(std::move(file)), description_(std::move(description)), limits_(limits) {}
  // Unpacked at its first use, and kept until nobody uses it any more.
  std::shared_ptr<const UnpackedFmu> Unpack() const;

  std::filesystem::path file_;
  FmuDescription description_;
  WorkerLimits limits_;
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const UnpackedFmu> unpacked_;
};

}  // namespace polyest::internal
