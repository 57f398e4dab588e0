#include "core/estimator/expansion/carry_over.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "core/common/infeasible.h"
#include "core/common/status.h"
#include "core/estimator/expansion/carried_state.h"
#include "core/estimator/expansion/replay.h"
#include "core/estimator/expansion/state_pairs.h"
#include "core/propagation/ensemble_points.h"

namespace polyest::internal {
namespace {

// Rows since the state kept, or half of those between two checkpoints if these are fewer, that it
// takes to judge the states.
constexpr int64_t kMinRows = 256;
// Factor by which the record may become longer before the error of the states exceeds the limit.
constexpr double kRoomToGrow = 16;

absl::Status Refused(const char* why) { return InfeasibleError(why); }

int64_t RowsToJudge(const ResolvedProblem& problem) {
  const int64_t interval = problem.problem().integration.samples_between_checkpoints;
  return std::clamp<int64_t>(interval / 2, 1, kMinRows);
}

// Returns the largest coordinate of the points (local coordinates of `to`) in units of the trusted
// box of `from`; at least 1.
double ReachOf(const ExpansionDesign& from, const ExpansionDesign& to) {
  const Matrix units = TrustedRegion(from).ManyToLocal(to.region.ManyToGerm(to.points));
  return std::max(1.0, units.cwiseAbs().maxCoeff());
}

absl::Status Refusal(const ResolvedProblem& problem, const RegionalExpansion& present,
                     const ExpansionState& kept, const ExpansionDesign& design) {
  const Truncation& before = present.design().basis->truncation();
  const Truncation& after = design.basis->truncation();
  if (before.exponent != 1 || after.exponent != 1 || after.order < before.order) {
    return Refused("the terms are not those of the expansion before");
  }
  if (problem.ended_runs() != nullptr) return Refused("sums of ended runs are not carried over");
  const auto valid = [](const std::vector<bool>& flags) {
    return std::ranges::count(flags, false) == 0;
  };
  const TrajectoryState& trajectories = kept.trajectories;
  if (std::ssize(trajectories.kept) != present.points() || !present.failures().empty() ||
      !valid(kept.absorbed.check_valid) || !valid(kept.absorbed.control_valid)) {
    return Refused("trajectories have failed");
  }
  const auto learned = [](const CorrelationProfile& profile) { return !profile.empty(); };
  if (std::ranges::any_of(kept.absorbed.profiles, learned)) {
    return Refused("the correlation of noise is being learned");
  }
  if ((trajectories.ensemble && !AreSmooth(*trajectories.ensemble)) ||
      (trajectories.controls && !AreSmooth(*trajectories.controls))) {
    return Refused("the states are not smooth");
  }
  return absl::OkStatus();
}

// Returns by how much the square of an error of degree p + 1 grows where the new region reaches
// beyond the old one.
double GrowthIn(const ExpansionDesign& design, const ExpansionDesign& before) {
  return std::pow(ReachOf(before, design), 2 * (before.basis->order() + 1));
}

// Returns Σ ρ/R of the sums in the new region: what the fit leaves at the collocation points, or
// the old check points in the new region show; and the square of the error of the log variances,
// which a shift in standard deviations does not exceed either.
double ErrorIn(const ExpansionDesign& design, const RegionalExpansion& present,
               const AbsorbedRows& absorbed) {
  const ExpansionDesign& before = present.design();
  const Matrix checks = design.region.ManyToLocal(before.region.ManyToGerm(before.check_points));
  double error = absorbed.own_error;
  for (Eigen::Index i = 0; i < checks.rows(); ++i) {
    const bool inside = checks.row(i).cwiseAbs().maxCoeff() <= 1;
    if (inside) error = std::max(error, absorbed.check_residual[i]);
  }
  const double of_variances = present.LogVarianceError();
  return (error + of_variances * of_variances) * GrowthIn(design, before);
}

// The errors of what is taken over.
struct Inherited {
  double error = 0;        // Σ ρ/R of the sums
  double rate = 0;         // what each further sample of the run adds to it
  int64_t propagated = 0;  // trajectories × rows that it took to find out
};

// Judges whether the sums and the states can be carried over.
absl::StatusOr<Inherited> Judge(const ResolvedProblem& problem, const RegionalExpansion& present,
                                const ExpansionState& kept, const ExpansionDesign& design,
                                const SampleStore& store, int64_t rows, int threads,
                                const Stop& stop, double max_shift) {
  POLYEST_RETURN_IF_ERROR(Refusal(problem, present, kept, design));
  Inherited inherited{.error = ErrorIn(design, present, kept.absorbed)};
  const double misfit = present.noise().misfit;
  if (!(present.RoundingError() <= max_shift * misfit)) return Refused("the sums are rounded");
  const double max_error = max_shift * max_shift * misfit;
  if (!(inherited.error <= max_error)) return Refused("the sums are not accurate enough");
  if (!kept.trajectories.ensemble) return inherited;
  if (rows - kept.absorbed.rows < RowsToJudge(problem)) {
    return Refused("too few rows tell how accurate the states are");
  }
  POLYEST_ASSIGN_OR_RETURN(const PairComparison pairs,
                           ComparePairs(problem, present, kept, store, rows, threads, stop));
  inherited.propagated = pairs.propagated;
  inherited.rate =
      kept.absorbed.carried_rate + pairs.mean_square * GrowthIn(design, present.design());
  const double to_come = kRoomToGrow * static_cast<double>(present.absorbed().sample_count);
  if (!(inherited.error + inherited.rate * to_come <= max_error)) {
    return Refused("the states are not accurate enough");
  }
  return inherited;
}

}  // namespace

absl::StatusOr<std::unique_ptr<RegionalExpansion>> CarryOver(
    const ResolvedProblem& problem, const RegionalExpansion& present, const ExpansionDesign& design,
    const SampleStore& store, int64_t rows, int threads, const Stop& stop, double max_shift) {
  const std::shared_ptr<const ExpansionState> kept = present.kept_state();
  if (!kept || rows != present.absorbed_rows()) return Refused("there is no state to go on from");
  POLYEST_ASSIGN_OR_RETURN(const Inherited inherited, Judge(problem, present, *kept, design, store,
                                                            rows, threads, stop, max_shift));
  POLYEST_ASSIGN_OR_RETURN(ExpansionState state,
                           CarriedState(problem, present, *kept, design, inherited.error, stop));
  state.absorbed.propagated = inherited.propagated;
  state.absorbed.carried_rate = inherited.rate;
  absl::StatusOr<std::unique_ptr<RegionalExpansion>> moved =
      RegionalExpansion::FromState(problem, std::move(state), store, threads, stop);
  if (absl::IsDataLoss(moved.status())) return Refused("the state cannot be carried over");
  POLYEST_RETURN_IF_ERROR(moved.status());
  POLYEST_RETURN_IF_ERROR(TakeRows(store, rows, stop, **moved));
  return moved;
}

// Twice the rows since the state kept: to compare the states, and to go on from it.
int64_t RowsToCarryOver(const RegionalExpansion& present, int64_t rows) {
  return present.kept_state() ? 2 * (rows - present.kept_state()->absorbed.rows) : 0;
}

absl::StatusOr<std::unique_ptr<RegionalExpansion>> Restored(const RegionalExpansion& present,
                                                            const ResolvedProblem& problem,
                                                            const SampleStore& store, int64_t rows,
                                                            int threads, const Stop& stop) {
  if (!present.kept_state()) {
    return Replay(problem, present.design(), present.noise(), store, rows, threads, stop);
  }
  ExpansionState state = *present.kept_state();
  state.noise = present.noise();
  state.design.element =
      present.design().element.bounds();  // it may have been freed from bounds since
  POLYEST_ASSIGN_OR_RETURN(
      auto restored, RegionalExpansion::FromState(problem, std::move(state), store, threads, stop));
  POLYEST_RETURN_IF_ERROR(TakeRows(store, rows, stop, *restored));
  return restored;
}

}  // namespace polyest::internal
