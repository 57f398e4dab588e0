#pragma once

// Propagation (9): one trajectory of the model for each point of an ensemble, advanced together
// from one sample time to the next, with the measured outputs read at exactly those times.
//
// The points are dealt into blocks of fixed size, each integrated as one ODE system. Blocks are
// independent, so results have the same bits for any number of threads and for any division of the
// sample times into calls of Advance. A model that simulates itself propagates its own ensemble;
// the other models have checkpoints, from which an ensemble can be restored.

#include <absl/status/status.h>

#include <memory>
#include <span>
#include <vector>

#include "core/common/types.h"
#include "core/propagation/delayed_outputs.h"
#include "core/propagation/trajectory_ensemble.h"
#include "polyest/stop.h"

namespace polyest::internal {

// Returns whether ensembles of the model have a State at a checkpoint, unless outputs have delays.
bool HasCheckpointsInRuns(const Model& model);

class EnsemblePropagator final : public TrajectoryEnsemble {
 public:
  // Starts the ensemble at t = 0. `inputs` must outlive the propagator; knots of streamed inputs
  // may be appended between calls, but not at or before a time already passed.
  EnsemblePropagator(EnsembleSpecification specification, const InputSignals* inputs);

  int points() const override { return ensemble_->points(); }
  absl::Status Advance(std::span<const double> times_s, MatrixRef outputs,
                       const Stop& stop) override;
  const std::vector<PointFailure>& failures() const override { return failures_; }
  std::optional<EnsembleState> State() const override { return ensemble_->State(); }
  bool Restore(const EnsembleState& state) override;

  // Returns, for outputs with delays, the largest error of any point, by column of the last
  // Advance, that is due to their interpolation (delayed_outputs.h); empty without delays.
  const Vector& delay_errors() const { return delay_errors_; }

 private:
  void FailBeyondLimit(std::span<const double> times_s, MatrixRef outputs);
  void UpdateFailures();

  Matrix output_gains_;    // Q × m, or empty
  Matrix output_offsets_;  // Q × m, or empty
  std::unique_ptr<TrajectoryEnsemble> ensemble_;
  DelayedOutputs* delayed_ = nullptr;  // `ensemble_`, if outputs have delays
  Vector delay_errors_;
  std::vector<PointFailure> beyond_;    // points whose gain or offset takes an output too far
  std::vector<PointFailure> failures_;  // those of the ensemble, then these
};

}  // namespace polyest::internal
