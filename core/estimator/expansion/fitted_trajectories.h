#pragma once

// The trajectories of an expansion along the record, and the fit of their outputs, block by block.
//
// There is one for each collocation point, whose outputs are fitted, and one for each check point,
// with which the fit is compared. Some check points have a control trajectory besides, with a
// smaller tolerance (control_trajectories.h). Each run begins at t = 0 from the initial states,
// with its own inputs. Trajectories that cannot be integrated are left out of the fit from there
// on.
//
// Where the likelihood is that of prediction errors (polyest/problem.h), each point runs a filter
// (propagation/filter_bank.h), and what is expanded is the whitened innovation w = ν/√S and
// log(S/σ²). The innovations take the place of the residuals: y_k stands for z_k − σ_k w_k.

#include <absl/status/status.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/chaos/collocation_matrix.h"
#include "core/chaos/packed_matrix.h"
#include "core/estimator/expansion/expansion_design.h"
#include "core/estimator/expansion/failed_trajectory.h"
#include "core/estimator/expansion/fitted_block.h"
#include "core/estimator/record/learned_noise.h"
#include "core/estimator/record/run_inputs.h"
#include "core/estimator/record/whitening.h"
#include "core/propagation/filter_bank.h"

namespace polyest::internal {

// Expansions of the means and the standard deviations of filters' states, S × states each.
struct FilteredStates {
  Matrix mean;
  Matrix deviation;
};

// The state between two rows as plain data.
struct TrajectoryState {
  std::vector<int> kept;
  std::vector<FailedTrajectory> failures;
  // These describe the middle of a run; they are empty if a new run begins.
  int run = 0;
  std::optional<EnsembleState> ensemble;
  std::optional<EnsembleState> controls;  // present if `ensemble` is and there are controls
  std::vector<PreviousSample> previous;   // one per channel
};

class FittedTrajectories {
 public:
  // `matrix` is that of the design's collocation points. `problem`, `store`, which has the rows,
  // and `design`, whose basis and points stay as they are, must outlive the object; the store may
  // be null if no input is streamed.
  FittedTrajectories(const ResolvedProblem& problem, const SampleStore* store,
                     const ExpansionDesign& design, const std::vector<ChannelNoise>& noise,
                     CollocationMatrix matrix, int threads);

  int points() const { return static_cast<int>(design_.points.rows()); }        // Q
  int checks() const { return static_cast<int>(design_.check_points.rows()); }  // C
  int controls() const { return controls_; }                                    // K
  int count() const { return points() + checks() + controls(); }
  // Whether they are stepped without error of integration (linear_system.h).
  bool StepsExactly() const;

  // Sets the row of the store that is the first to be propagated; no row has been yet.
  void BeginAt(int64_t row) { next_row_ = row; }
  // Propagates over rows of the store that follow those propagated before, and fills `block` with
  // them. Only a stop request or an error of the store returns an error; the object is then
  // unusable.
  absl::Status Propagate(const RowBlock& rows, FittedBlock& block, const Stop& stop);
  // Why the block filled last has rows that are not fitted; OK where all are.
  const absl::Status& shortage() const { return shortage_; }
  int64_t next_row() const { return next_row_; }    // of the store, to be propagated
  int run() const { return run_; }                  // the present one; −1 before the first row
  int64_t run_begin() const { return run_begin_; }  // row of the store at which it began

  // Returns the indices of the collocation points that are still in the fit, ascending.
  const std::vector<int>& kept() const { return kept_; }
  const std::vector<FailedTrajectory>& failures() const { return failures_; }
  // The matrix of the collocation points that are still in the fit.
  const CollocationMatrix& matrix() const { return matrix_; }
  // Returns the expansions of the filters' states after the rows propagated; nothing without
  // filters or before the first row.
  std::optional<FilteredStates> Filtered() const;

  TrajectoryState State() const;
  // Restores the run in whose middle the state was taken, after `rows` rows of the store. Returns
  // DataLoss when the state cannot belong to such trajectories, FailedPrecondition when the rows
  // differ from those of the state, or the store's errors.
  absl::Status RestoreRun(const TrajectoryState& state, int64_t rows, const SampleStore& store);
  // Restores what the state says of the fit. Returns DataLoss likewise, or the status of a stop
  // request.
  absl::Status RestoreFit(TrajectoryState state, const Stop& stop);

 private:
  int trajectories() const { return static_cast<int>(thetas_.rows()); }  // Q + C
  void StartRun(int run, int64_t first_row, int64_t first_knots);
  double InputReach(int run) const;
  absl::Status PropagateRun(int first, int count, FittedBlock& block, const Stop& stop);
  absl::Status Advance(int first, int count, FittedBlock& block, const Stop& stop);

  int CountControls() const;
  void StartControls(int run);
  bool RestoreEnsembles(const TrajectoryState& state);

  // Filters in place of trajectories (filter_trajectories.cc).
  void StartFilters(int run);
  absl::Status AdvanceFilters(int first, int count, FittedBlock& block, const Stop& stop);

  // The fit (trajectory_fit.cc).
  absl::Status FitRows(int first, int count, FittedBlock& block, const Stop& stop);
  void FitColumns(int first, int count, const Matrix& all_values, Matrix& coefficients,
                  Vector& residual);
  void AddDelayErrors(int first, FittedBlock& block) const;
  bool FailsAt(int row, const FittedBlock& block) const;
  absl::Status DropFailed(int row, const FittedBlock& block, const Stop& stop);
  void NoteFailures(int row, const FittedBlock& block);

  const ResolvedProblem& problem_;
  const SampleStore* store_;
  const ExpansionDesign& design_;
  CollocationMatrix matrix_;
  int threads_;
  int channels_;
  PackedMatrix check_basis_;  // φ at the check points, C × S
  Matrix thetas_;             // (Q + C) × n
  int run_ = -1;
  int64_t run_begin_ = 0;  // row of the store at which the present run began
  int64_t next_row_;       // of the store: the first row not propagated
  int controls_;           // K
  Whitening whitening_;
  std::vector<int> kept_;  // collocation points that are still in the fit
  std::vector<FailedTrajectory> failures_;
  absl::Status shortage_;

  std::unique_ptr<RunInputs> inputs_;  // of the present run
  double input_reach_s_ = 0;           // how far back its trajectories may need the inputs
  std::unique_ptr<EnsemblePropagator> propagator_;
  std::unique_ptr<EnsemblePropagator> control_propagator_;  // null without controls
  // In place of the propagators where the likelihood is that of prediction errors; else null.
  std::unique_ptr<FilterBank> filters_;
  std::unique_ptr<FilterBank> control_filters_;  // null without controls, too
};

}  // namespace polyest::internal
