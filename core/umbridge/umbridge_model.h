#pragma once

// A model that UM-Bridge servers compute. The protocol knows no time: a model is asked either for
// its outputs at the times of samples, which it finds as the list "times" in the configuration
// beside what its inputs have done up to then, or, if its description lists times, once for its
// outputs at all of them.

#include <absl/status/statusor.h>

#include <filesystem>
#include <memory>
#include <string>

#include "core/propagation/trajectory_ensemble.h"
#include "core/umbridge/evaluation_pool.h"
#include "core/umbridge/model_file.h"

namespace polyest::internal {

class UmBridgeModel final : public SelfPropagatingModel {
 public:
  // Reads a description; asks no server. Returns FailedPrecondition with the reason if the file
  // cannot be used.
  static absl::StatusOr<std::shared_ptr<const UmBridgeModel>> Read(
      const std::filesystem::path& file, const std::string& name);

  explicit UmBridgeModel(UmBridgeDescription description);

  const ModelDescription& description() const override { return description_->model; }
  // Starts an ensemble. An error of the servers, or of all of them, is that of its Advance.
  std::unique_ptr<TrajectoryEnsemble> StartEnsemble(EnsembleSpecification specification,
                                                    const InputSignals* inputs) const override;

 private:
  std::shared_ptr<const UmBridgeDescription> description_;
  // All ensembles share it, so that the servers get no more requests at once than they may.
  std::shared_ptr<EvaluationPool> pool_;
};

}  // namespace polyest::internal
