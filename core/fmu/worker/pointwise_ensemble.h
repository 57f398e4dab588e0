#pragma once

// An ensemble whose trajectories are simulated independently, one after the other, through all
// sample times.

#include <memory>
#include <string>
#include <vector>

#include "core/propagation/trajectory_ensemble.h"

namespace polyest::internal {

class PointTrajectory {
 public:
  virtual ~PointTrajectory() = default;

  // Advances to time_s, which must not be before the present time. Returns false if the trajectory
  // has failed.
  virtual bool AdvanceTo(double time_s) = 0;
  // Reads the outputs at the present time. Returns false if the trajectory has failed.
  virtual bool ReadOutputs(double* outputs) = 0;
  // Returns the reason of the failure and the last time at which the trajectory was valid.
  virtual PointFailure failure() const = 0;
};

class PointwiseEnsemble final : public TrajectoryEnsemble {
 public:
  PointwiseEnsemble(std::vector<std::unique_ptr<PointTrajectory>> points, int outputs)
      : points_(std::move(points)), outputs_(outputs) {}

  int points() const override { return static_cast<int>(points_.size()); }
  absl::Status Advance(std::span<const double> times_s, MatrixRef outputs,
                       const Stop& stop) override;
  const std::vector<PointFailure>& failures() const override { return failures_; }

 private:
  void AdvancePoint(int point, std::span<const double> times_s, MatrixRef outputs);

  std::vector<std::unique_ptr<PointTrajectory>> points_;  // null once failed
  const int outputs_;
  std::vector<PointFailure> failures_;
};

}  // namespace polyest::internal
