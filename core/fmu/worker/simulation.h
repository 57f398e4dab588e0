#pragma once

// Everything that a worker computes: its blocks of points, each simulated as an ensemble, or the
// equations of its points.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <memory>
#include <vector>

#include "core/fmu/messages.h"
#include "core/fmu/worker/exchange_model.h"
#include "core/fmu/worker/instance.h"
#include "core/propagation/block_inputs.h"

namespace polyest::internal {

class Simulation {
 public:
  // Starts the simulation. Returns FailedPrecondition when the FMU cannot be used at all.
  static absl::StatusOr<std::unique_ptr<Simulation>> Start(StartMessage start, Monitor* monitor);

  // Appends the new knots and advances all blocks through the sample times of `message`.
  absl::Status Answer(const AdvanceMessage& message, ResultMessage& result);
  // Evaluates the equations. The first message must ask for initial states.
  absl::Status Answer(const EvaluateMessage& message, ResultMessage& result);

 private:
  Simulation(StartMessage start, InputSignals signals, std::unique_ptr<FmuLibrary> library,
             Monitor* monitor);
  absl::Status AppendKnots(const AdvanceMessage& message);
  void MakeBlocks();
  std::unique_ptr<TrajectoryEnsemble> MakeBlock(int first, int points);
  std::unique_ptr<Instance> MakeInstance(int row, const Vector& inputs);
  absl::Status MakeInstances(const EvaluateMessage& message);

  StartMessage start_;
  InputSignals signals_;
  std::unique_ptr<FmuLibrary> library_;
  InstanceFactory factory_;
  EnsembleSpecification channels_;  // amplitudes, delays and offsets of all points
  std::vector<std::unique_ptr<TrajectoryEnsemble>> blocks_;
  std::unique_ptr<ExchangeModel> equations_;  // null unless they are evaluated
};

}  // namespace polyest::internal
