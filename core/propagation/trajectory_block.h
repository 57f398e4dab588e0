#pragma once

// A block of trajectories: up to kPoints points of an ensemble, advanced by one integrator.
//
// Rows beyond the block's own points, up to a multiple of kLanes, carry copies of its last point. A
// copy of a good point replaces a point that fails, so the shape does not change.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <Eigen/Core>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/common/types.h"
#include "core/model/switching_model.h"
#include "core/propagation/block_inputs.h"
#include "core/propagation/block_integrator.h"
#include "core/propagation/trajectory_ensemble.h"
#include "polyest/stop.h"

namespace polyest::internal {

class TrajectoryBlock final : public BlockSystem {
 public:
  static constexpr int kPoints = 64;

  // Takes points first_point … first_point + points − 1 of the specification. The specification and
  // the inputs must outlive the block. `exact`: the ensemble StepsExactly (linear_system.h).
  TrajectoryBlock(const EnsembleSpecification* specification, const InputSignals* inputs,
                  int first_point, int points, bool exact);

  Eigen::Index points() const override { return states_.rows(); }
  Eigen::Index states() const override { return states_.cols(); }
  void Derivatives(double time_s, const ConstBlock& states, Block derivatives) override;
  // Writes dx/dt of the first row's trajectory at each of some states (a multiple of kLanes rows).
  void FirstDerivatives(double time_s, const Eigen::ArrayXXd& states, Block derivatives);
  bool StateJacobian(double time_s, const ConstBlock& states, Block jacobian) override;

  // As EnsemblePropagator::Advance, for this block's rows of outputs.
  absl::Status Advance(std::span<const double> times_s, MatrixRef outputs, const Stop& stop);

  const std::vector<PointFailure>& failures() const { return failures_; }
  bool IsAlive(int point) const { return point_alive_[static_cast<size_t>(point)]; }

  const Eigen::ArrayXXd& state_values() const { return states_; }  // rows × states

  // For a filter (filter_block.h), which changes the states itself. Replaces the states of all rows
  // at the present time (rows × states); a row that carries another point takes that point's.
  void SetStates(const Eigen::ArrayXXd& states);
  // Sets the present time, at which the inputs must be known. The states must be set next.
  void SetTime(double time_s);
  // Returns the outputs that are read (rows × outputs), of the states set last. A point without
  // finite outputs fails.
  const Eigen::ArrayXXd& OutputsOfStates();
  // Returns the outputs at other states (rows × states) at the present time, which need not be
  // finite. The states must be set again before the block goes on.
  const Eigen::ArrayXXd& OutputsAt(const Eigen::ArrayXXd& states);
  // Advances the states set last to `time_s` ≥ the present time and returns them (rows × states).
  absl::StatusOr<const Eigen::ArrayXXd*> Move(double time_s, const Stop& stop);
  // Leaves out those of the points that have not failed yet.
  void LeaveOut(std::span<const int> points, const char* reason);

  // Restarts the integration from the present states as if they were initial states.
  void Restart();
  // Returns the state from which a restart continues.
  EnsembleState::OfBlock State() const;
  // Returns whether `state` can belong to such a block.
  bool Fits(const EnsembleState::OfBlock& state) const;
  // Continues from `state`; the block must not have advanced yet.
  void Restore(double time_s, const EnsembleState::OfBlock& state);

 private:
  // A time at which the integrator stops on its way.
  struct StopTime {
    double time_s = std::numeric_limits<double>::infinity();
    bool jumps = false;
    bool is_break = false;  // of an input, rather than a time at which to look
  };

  void CopyStates(const Eigen::ArrayXXd& states);
  void StartIntegrator(double time_s);
  bool MayChangeMethod() const;
  StopTime NextStop();
  absl::Status AdvanceStates(double time_s, const Stop& stop);
  absl::Status Reach(double time_s, double stop_time_s, const Stop& stop);
  void ReadOutputs(double time_s, int sample, MatrixRef outputs);
  // Fails the rows with a value that is not finite or beyond 1e100, whose square an estimate's sums
  // could not hold.
  void FailRowsBeyond(const Eigen::ArrayXXd& values, double time_s, const char* what);
  // Leaves out the point in that row from now on.
  void Fail(Eigen::Index row, double time_s, int flag, std::string reason);
  void CarryPoint(Eigen::Index row, Eigen::Index point);
  void SelectOutputs();
  bool alive() const { return alive_points_ > 0; }

  const EnsembleSpecification* specification_;
  const StateSpaceModel* model_;
  const SwitchingModel* switching_;  // the same model if its equations switch, else null
  const int first_point_;
  const InputSignals* const signals_;
  const bool exact_;
  bool streamed_ = false;          // a knot yet to come must not change a step already taken
  bool stops_at_samples_ = false;  // because of that, or because the equations may use the time

  std::vector<int> source_;  // the block's own point that each row carries
  Eigen::ArrayXXd parameters_;
  BlockInputs inputs_;
  Eigen::ArrayXXd states_;
  Eigen::ArrayXXd modes_;  // as EnsembleState::OfBlock::modes
  Eigen::ArrayXXd model_outputs_;
  Eigen::ArrayXXd selected_outputs_;
  Eigen::ArrayXXd first_parameters_, first_inputs_;  // the first row's, once for each state

  std::vector<bool> point_alive_;
  int alive_points_;
  int integrated_points_ = 0;  // how many were alive when the integrator was started
  bool stiff_ = false;
  double time_s_ = 0;
  double last_break_s_ = 0;
  std::unique_ptr<BlockIntegrator> integrator_;
  std::vector<PointFailure> failures_;
};

}  // namespace polyest::internal
