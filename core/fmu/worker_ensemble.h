#pragma once

// An ensemble of an FMU's trajectories in worker processes. Points that are integrated together are
// split into blocks of kPointsOfBlock, others into blocks of one, and the blocks are
// distributed over as many workers as there may be threads. A block's results do not depend on the
// worker's other blocks, so they are the same for any number of workers.
//
// Where a process can hold one instance only, whose state cannot be saved, each point has a worker
// of its own, and as many of them as there may be threads work at a time. All ensembles of this
// process together have at most kMaxOfOneTrajectory such workers.

#include <absl/status/status.h>

#include <memory>
#include <vector>

#include "core/fmu/fmu_model.h"
#include "core/fmu/messages.h"
#include "core/fmu/worker_process.h"
#include "core/propagation/trajectory_ensemble.h"

namespace polyest::internal {

class WorkerEnsemble final : public TrajectoryEnsemble {
 public:
  static constexpr int kMaxOfOneTrajectory = 256;
  // Calls of an FMU cost so much more than the arithmetic of an integrator that small blocks, which
  // several workers can share, are better than wide ones.
  static constexpr int kPointsOfBlock = 16;

  // Makes the ensemble. The processes start with the first Advance, which also reports an error of
  // starting them; RESOURCE_EXHAUSTED where there would be too many.
  WorkerEnsemble(std::shared_ptr<const UnpackedFmu> fmu, EnsembleSpecification specification,
                 const InputSignals* inputs, const WorkerLimits& limits);
  ~WorkerEnsemble() override;

  int points() const override { return static_cast<int>(specification_.parameters.rows()); }
  absl::Status Advance(std::span<const double> times_s, MatrixRef outputs,
                       const Stop& stop) override;
  const std::vector<PointFailure>& failures() const override { return failures_; }

 private:
  struct Worker {
    std::unique_ptr<WorkerProcess> process;
    std::vector<int> rows;  // rows of the ensemble that it simulates
    std::vector<PointFailure> failures;
  };

  // Counts workers that hold one trajectory each, unless there would be too many.
  absl::Status Reserve(int workers);
  absl::Status StartWorkers();
  StartMessage MakeStart(const std::vector<int>& block_points, const std::vector<int>& rows) const;
  AdvanceMessage MakeAdvance(std::span<const double> times_s);
  // Lets workers advance at the same time.
  absl::Status AdvanceTogether(std::span<Worker> workers, const std::string& message,
                               MatrixRef outputs, const Stop& stop);
  absl::Status TakeResult(Worker& worker, MatrixRef outputs);
  void KillAll();

  std::shared_ptr<const UnpackedFmu> fmu_;
  EnsembleSpecification specification_;
  const InputSignals* inputs_;
  WorkerLimits limits_;
  int reserved_ = 0;  // workers
  std::vector<Worker> workers_;
  std::vector<size_t> knots_sent_;  // number per input
  std::vector<PointFailure> failures_;
};

}  // namespace polyest::internal
