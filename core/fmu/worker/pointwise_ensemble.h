#pragma once

// Trajectories that each go their own way, one after the other, through the sample times.

#include <memory>
#include <string>
#include <vector>

#include "core/propagation/trajectory_ensemble.h"

namespace polyest::internal {

class PointTrajectory {
 public:
  virtual ~PointTrajectory() = default;

  // To time_s, no earlier than where it is. false: it has failed.
  virtual bool AdvanceTo(double time_s) = 0;
  // The outputs at the time reached.
  virtual bool ReadOutputs(double* outputs) = 0;
  // Why it has failed, and the last time at which it was good.
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

  std::vector<std::unique_ptr<PointTrajectory>> points_;  // null once it has failed
  const int outputs_;
  std::vector<PointFailure> failures_;
};

}  // namespace polyest::internal
