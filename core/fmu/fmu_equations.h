#pragma once

// The equations of an FMU for Model Exchange without events: its instances stay in worker
// processes, and each call sends a block of states to one of them.
//
// Groups of points that are evaluated together are dealt over the workers. A point's values do not
// depend on the other points, so they are the same for any number of workers.

#include <absl/status/status.h>

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "core/fmu/fmu_model.h"
#include "core/fmu/messages.h"
#include "core/fmu/worker_process.h"
#include "core/propagation/point_equations.h"
#include "core/propagation/trajectory_ensemble.h"

namespace polyest::internal {

class FmuEquations final : public PointEquations {
 public:
  // The arguments are those of SelfPropagatingModel::StartEquations. The processes start with the
  // first evaluation, whose inputs the FMU is initialized with.
  FmuEquations(std::shared_ptr<const UnpackedFmu> fmu, const EnsembleSpecification& specification,
               const InputSignals* inputs, int points_together, const WorkerLimits& limits);

  const ModelDescription& description() const override { return description_; }
  void InitialStates(const ConstBlock& points, Block states) const override;
  void Derivatives(double time_s, const ConstBlock& states, const ConstBlock& points,
                   const ConstBlock& inputs, Block derivatives) const override;
  void Outputs(double time_s, const ConstBlock& states, const ConstBlock& points,
               const ConstBlock& inputs, Block outputs) const override;

  void Heed(const Stop& stop) override { stop_ = stop; }
  absl::Status status() const override;
  std::string FailureOf(int point) const override;

 private:
  struct Worker {
    std::vector<int> points;  // that it evaluates
    std::mutex mutex;         // for the process
    std::unique_ptr<WorkerProcess> process;
  };

  void Evaluate(EvaluateMessage message, const ConstBlock& points, Block values) const;
  absl::Status Ask(Worker& worker, const EvaluateMessage& message, Block values) const;
  void Note(const Worker& worker, const EvaluateMessage& message,
            const std::vector<PointFailure>& failures) const;

  std::shared_ptr<const UnpackedFmu> fmu_;
  EnsembleSpecification specification_;
  const InputSignals* inputs_;
  WorkerLimits limits_;
  ModelDescription description_;
  Stop stop_;
  std::vector<std::unique_ptr<Worker>> workers_;
  std::vector<Worker*> worker_of_;  // by point
  std::vector<int> row_of_;         // by point: its number in the worker

  mutable std::mutex mutex_;  // for what follows
  mutable absl::Status ended_;
  mutable std::vector<std::string> failure_of_;  // by point
};

}  // namespace polyest::internal
