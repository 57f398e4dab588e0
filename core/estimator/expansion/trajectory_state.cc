// The state of the trajectories between two rows (fitted_trajectories.h).

#include <algorithm>
#include <functional>
#include <utility>

#include "core/common/infeasible.h"
#include "core/common/status.h"
#include "core/estimator/expansion/fitted_trajectories.h"
#include "core/estimator/expansion/inconsistent_state.h"

namespace polyest::internal {
namespace {

bool IsAscendingBelow(const std::vector<int>& numbers, int end) {
  return std::ranges::adjacent_find(numbers, std::ranges::greater_equal()) == numbers.end() &&
         (numbers.empty() || (numbers.front() >= 0 && numbers.back() < end));
}

}  // namespace

TrajectoryState FittedTrajectories::State() const {
  TrajectoryState state;
  state.kept = kept_;
  state.failures = failures_;
  state.run = run_;
  if (propagator_) state.ensemble = propagator_->State();
  if (control_propagator_) state.controls = control_propagator_->State();
  if (filters_) state.ensemble = filters_->State();
  if (control_filters_) state.controls = control_filters_->State();
  state.previous = whitening_.State();
  return state;
}

absl::Status FittedTrajectories::RestoreRun(const TrajectoryState& state, int64_t rows,
                                            const SampleStore& store) {
  const int64_t samples = state.ensemble->samples;
  if (samples < 1 || samples > rows || rows > store.rows() || state.run < 0 ||
      (problem_.per_run() && state.run >= problem_.runs())) {
    return InconsistentState("run");
  }
  const int64_t begin = rows - samples;
  RowBlock block;
  POLYEST_RETURN_IF_ERROR(store.Read(rows - 1, 1, block));
  const SampleRow last = block.rows.front();
  POLYEST_RETURN_IF_ERROR(store.Read(begin, 1, block));
  if (last.run != state.run || block.rows.front().run != state.run ||
      last.time_s != state.ensemble->time_s) {
    return absl::FailedPreconditionError("the rows appended are not those of the snapshot");
  }
  const double reach_s = InputReach(state.run);
  int64_t first_knots = begin;
  if (reach_s < kInfinity) {
    POLYEST_ASSIGN_OR_RETURN(first_knots,
                             RowOfFirstKnots(problem_, store, begin, rows, last.time_s - reach_s));
  }
  StartRun(state.run, begin, first_knots);
  POLYEST_RETURN_IF_ERROR(inputs_->ReadUpTo(last.time_s));
  if (!inputs_->SettledFor(last.time_s)) {
    return absl::FailedPreconditionError(
        "the rows that settle the inputs at the snapshot have not been appended");
  }
  return RestoreEnsembles(state) ? absl::OkStatus() : InconsistentState("ensemble");
}

bool FittedTrajectories::RestoreEnsembles(const TrajectoryState& state) {
  const EnsembleState& ensemble = *state.ensemble;
  const bool controls_fit =
      controls_ == 0 || (state.controls && state.controls->samples == ensemble.samples &&
                         state.controls->time_s == ensemble.time_s &&
                         (control_filters_ ? control_filters_->Restore(*state.controls)
                                           : control_propagator_->Restore(*state.controls)));
  return controls_fit && (filters_ ? filters_->Restore(ensemble) : propagator_->Restore(ensemble));
}

absl::Status FittedTrajectories::RestoreFit(TrajectoryState state, const Stop& stop) {
  for (const PreviousSample& sample : state.previous) {
    if (sample.output.size() != count()) return InconsistentState("correlated noise");
  }
  if (std::ssize(state.previous) != channels_) return InconsistentState("correlated noise");
  whitening_.Restore(std::move(state.previous));
  for (const FailedTrajectory& failure : state.failures) {
    if (failure.theta.size() != thetas_.cols()) return InconsistentState("failed trajectories");
  }
  failures_ = std::move(state.failures);
  if (!IsAscendingBelow(state.kept, points())) return InconsistentState("collocation points");
  if (std::ssize(state.kept) == points()) return absl::OkStatus();
  kept_ = std::move(state.kept);
  const Matrix left = design_.points(kept_, Eigen::all);
  absl::StatusOr<CollocationMatrix> matrix = CollocationMatrix::Factor(*design_.basis, left, stop);
  if (IsInfeasible(matrix.status())) return InconsistentState("collocation points");
  POLYEST_RETURN_IF_ERROR(matrix.status());
  matrix_ = *std::move(matrix);
  return absl::OkStatus();
}

}  // namespace polyest::internal
