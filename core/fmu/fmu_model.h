#pragma once

// An FMU as a model that propagates its own trajectories, in separate worker processes.

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
  absl::Status status;  // the reason if it could not be unpacked
  std::unique_ptr<TemporaryFolder> folder;
};

class FmuModel final : public SelfPropagatingModel {
 public:
  // Reads the FMU's description without running any of its code. Returns FailedPrecondition with
  // the reason if the FMU cannot be used.
  static absl::StatusOr<std::shared_ptr<const FmuModel>> Read(const std::filesystem::path& file,
                                                              const std::string& name,
                                                              const WorkerLimits& limits);

  const ModelDescription& description() const override { return description_.model; }
  const FmuInterface& interface() const { return description_.interface; }

  // Starts an ensemble. If the FMU cannot be run, the ensemble's first Advance fails with
  // FailedPrecondition, or with Unavailable if that may change.
  std::unique_ptr<TrajectoryEnsemble> StartEnsemble(EnsembleSpecification specification,
                                                    const InputSignals* inputs) const override;
  std::string WhyNotFiltered() const override;
  std::shared_ptr<PointEquations> StartEquations(const EnsembleSpecification& specification,
                                                 const InputSignals* inputs,
                                                 int points_together) const override;

 private:
  FmuModel(std::filesystem::path file, FmuDescription description, const WorkerLimits& limits)
      : file_(std::move(file)), description_(std::move(description)), limits_(limits) {}
  // Unpacks the archive at first use. The folder exists as long as this model or an ensemble refers
  // to it. A failed attempt is repeated at the next use.
  std::shared_ptr<const UnpackedFmu> Unpack() const;

  std::filesystem::path file_;
  FmuDescription description_;
  WorkerLimits limits_;
  mutable std::mutex mutex_;
  mutable std::shared_ptr<const UnpackedFmu> unpacked_;
};

}  // namespace polyest::internal
