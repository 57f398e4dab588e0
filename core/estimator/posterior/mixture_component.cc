#include "core/estimator/posterior/mixture_component.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "core/common/status.h"
#include "core/estimator/expansion/carry_over.h"
#include "core/estimator/expansion/expansion_state.h"
#include "core/estimator/expansion/leaning.h"
#include "core/estimator/expansion/likelihood_power.h"
#include "core/estimator/expansion/new_runs.h"
#include "core/estimator/expansion/prior_prediction.h"
#include "core/estimator/expansion/reexpansion.h"
#include "core/estimator/expansion/replay.h"
#include "core/estimator/expansion/return_to_prior.h"
#include "core/estimator/posterior/noise_learning.h"

namespace polyest::internal {
namespace {

constexpr int64_t kBlockRows = 64;
// The fraction of the error that sums may have to be carried over from which on the expansion moves
// ahead of need. An error of order p + 1 in a phase grows as N^(p + 1.5), at order 3 twentyfold
// while the record doubles, and most of it is in the last states.
constexpr double kAheadOfNeed = 0.004;

// Returns the first of the thousand seeds that a re-expansion may use.
uint64_t SeedOfReexpansion(uint64_t tried) { return 1000 * (tried + 1); }

}  // namespace

MixtureComponent::MixtureComponent(const ResolvedProblem& problem, const SampleStore* store,
                                   int threads)
    : problem_(problem),
      store_(store),
      threads_(threads),
      learns_noise_(LearnsNoise(problem_.problem())),
      particles_(0, problem_.dimension()),
      allowance_(problem_.problem().expansion.max_replay_row_count) {}

absl::StatusOr<std::unique_ptr<MixtureComponent>> MixtureComponent::OfPrior(
    const ResolvedProblem& problem, const SampleStore* store, int threads,
    const TemperedBeginning& beginning, const Stop& stop) {
  std::unique_ptr<MixtureComponent> component(new MixtureComponent(problem, store, threads));
  POLYEST_ASSIGN_OR_RETURN(ExpansionDesign design,
                           DesignToBeginWith(component->problem_, beginning.in_tails));
  LearnedNoise noise = NoiseToBeginWith(problem.problem());
  noise.misfit = beginning.misfit;
  component->tempered_ = beginning;
  POLYEST_ASSIGN_OR_RETURN(component->expansion_,
                           RegionalExpansion::Make(component->problem_, store, std::move(design),
                                                   noise.ForNewExpansion(), threads, stop));
  component->room_ = MaxComponents(problem);
  return component;
}

absl::Status MixtureComponent::TakeUpTo(int64_t rows, const Stop& stop) {
  if (must_divide() || awaits_run()) return absl::OkStatus();
  POLYEST_RETURN_IF_ERROR(Recover(stop));
  // An earlier stop may have left the end of a window unprocessed.
  POLYEST_RETURN_IF_ERROR(FinishRow(stop).status());
  RowBlock block;
  while (taken_ < rows && !must_divide()) {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    POLYEST_RETURN_IF_ERROR(ReadBlock(rows, block, stop));
    if (awaits_run()) return absl::OkStatus();
    broken_ = true;
    POLYEST_RETURN_IF_ERROR(expansion_->Propagate(block, stop));
    POLYEST_ASSIGN_OR_RETURN(const bool through, AbsorbBlock(block, stop));
    if (through) broken_ = false;
  }
  return WithdrawTempering(stop);
}

// Reads the next rows, up to the first `rows` of the store, as far as the runs' parameters exist,
// or finds that a run is to be awaited.
absl::Status MixtureComponent::ReadBlock(int64_t rows, RowBlock& block, const Stop& stop) {
  const int64_t count = std::min(kBlockRows, rows - taken_);
  const auto read = [&](int64_t some) { return store_->Read(taken_, some, block); };
  POLYEST_RETURN_IF_ERROR(read(count));
  const int run = block.rows.front().run;
  if (problem_.per_run() && run >= problem_.runs()) {
    if (run >= problem_.max_joint_runs()) {
      awaited_run_ = run;
      return absl::OkStatus();
    }
    POLYEST_RETURN_IF_ERROR(BeginRun(run, stop));
  }
  int64_t known = 0;
  while (known < count &&
         (!problem_.per_run() || block.rows[static_cast<size_t>(known)].run < problem_.runs())) {
    ++known;
  }
  known = std::min<int64_t>(known, expansion_->RowsToKeptState(block));
  return known < count ? read(known) : absl::OkStatus();
}

// Replays the record so far with the parameters of the new run, as uncertain as their prior.
absl::Status MixtureComponent::BeginRun(int run, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem grown, problem_.WithRuns(run + 1));
  POLYEST_ASSIGN_OR_RETURN(ExpansionDesign design, DesignForNewRuns(grown, expansion_->design()));
  LearnedNoise noise = expansion_->noise().ForNewExpansion();
  noise.posterior = SummaryForNewRuns(grown, noise.posterior);
  noise.centre.resize(0);
  Matrix particles = ParticlesForNewRuns(grown, particles_);
  POLYEST_RETURN_IF_ERROR(
      ReplayAs(std::move(grown), std::move(design), std::move(noise), std::move(particles), stop));
  schedule_.CountAnewFrom(taken_);
  return absl::OkStatus();
}

// Propagates the record so far again for a problem with other runs, whose particles are given.
// Leaves everything as it is if that fails.
absl::Status MixtureComponent::ReplayAs(ResolvedProblem problem, ExpansionDesign design,
                                        LearnedNoise noise, Matrix particles, const Stop& stop) {
  std::swap(problem_, problem);  // the object stays in place, since expansions refer to it
  auto replayed =
      Replay(problem_, std::move(design), std::move(noise), *store_, taken_, threads_, stop);
  if (!replayed.ok()) {
    std::swap(problem_, problem);
    return replayed.status();
  }
  Adopt(*std::move(replayed));
  particles_ = std::move(particles);
  memory_ = {};
  return absl::OkStatus();
}

// After a stop in the middle of a block, propagates the same expansion again up to the last row
// taken, from the state that it has kept.
absl::Status MixtureComponent::Recover(const Stop& stop) {
  if (!broken_) return absl::OkStatus();
  POLYEST_ASSIGN_OR_RETURN(expansion_,
                           Restored(*expansion_, problem_, *store_, taken_, threads_, stop));
  broken_ = false;
  return absl::OkStatus();
}

// Returns false when the expansion has moved and the rest of the block must be propagated again.
absl::StatusOr<bool> MixtureComponent::AbsorbBlock(const RowBlock& block, const Stop& stop) {
  for (int row = 0; row < block.count(); ++row) {
    POLYEST_ASSIGN_OR_RETURN(const bool raised, RaiseUnlearnedScales(block, row, stop));
    if (raised) return false;
    const bool short_of_trajectories = row == expansion_->fitted_rows();
    bool too_coarse = false;
    const bool coarse = !short_of_trajectories && !schedule_.ToleratesResiduals(taken_) &&
                        expansion_->ResidualToNoise(row) > CoarseResidual();
    if (short_of_trajectories || (adaptive() && coarse)) {
      POLYEST_ASSIGN_OR_RETURN(const bool moved, RefineBefore(row, stop));
      if (moved) return false;
      too_coarse = !short_of_trajectories && MayBisect();
    }
    expansion_->Absorb(row);
    summary_.Add(block, row, problem_.channels());
    AddPredictionsOf(*expansion_, row, summary_);
    ++taken_;
    last_row_too_coarse_ = too_coarse;
    POLYEST_ASSIGN_OR_RETURN(const bool moved, FinishRow(stop));
    if (moved) return false;
  }
  return true;
}

// Does what is due after the last row taken, all of which may be done again after a stop. Returns
// true when the expansion has moved or must be divided.
absl::StatusOr<bool> MixtureComponent::FinishRow(const Stop& stop) {
  bool moved = false;
  if (last_row_too_coarse_) {
    POLYEST_ASSIGN_OR_RETURN(moved, ContractOrBisect(stop));
    last_row_too_coarse_ = false;
  }
  if (must_divide()) return true;
  bool settled = false;
  if ((adaptive() || learns_noise_) && schedule_.WindowEnds(taken_)) {
    POLYEST_ASSIGN_OR_RETURN(settled, EndWindow(stop));
  } else if (adaptive() && schedule_.LooksAtEdges(taken_)) {
    POLYEST_ASSIGN_OR_RETURN(settled, MoveIfLeaning(stop));
  } else if (LooksAhead()) {
    POLYEST_ASSIGN_OR_RETURN(settled, MoveAheadOfNeed(stop));
  }
  schedule_.EndRow(taken_);
  return moved || settled;
}

// Handles a next row at which the present expansion is too coarse or too few trajectories are left.
absl::StatusOr<bool> MixtureComponent::RefineBefore(int row, const Stop& stop) {
  const bool short_of_trajectories = row == expansion_->fitted_rows();
  const bool may_reexpand = schedule_.MayReexpandBefore(taken_);
  // There is no expansion to stay with.
  if (short_of_trajectories) allowance_.ExemptAt(taken_);
  if (adaptive() && taken_ > 0 && may_reexpand) {
    POLYEST_ASSIGN_OR_RETURN(const bool moved, MoveToPosterior(stop, !short_of_trajectories));
    schedule_.CountAttempt();
    if (moved) return true;
  }
  if (LookForPieces()) return true;
  if (short_of_trajectories) {
    // Where not one trajectory is left in an element and in its halves, it is not searched further.
    const bool hopeless = bisected_ && expansion_->kept_points().empty();
    if (!hopeless && BisectElement()) return true;
    return expansion_->shortage();
  }
  if (MayBisect()) return false;
  schedule_.TolerateResiduals(taken_);
  return false;
}

absl::StatusOr<bool> MixtureComponent::EndWindow(const Stop& stop) {
  if (learns_noise_ && !row_end_.learned) {
    POLYEST_ASSIGN_OR_RETURN(row_end_.learned, LearnNoise(stop));
  }
  bool moved = row_end_.learned.value_or(false);
  if (adaptive()) {
    POLYEST_ASSIGN_OR_RETURN(const bool settled, MoveWithMisfit(stop));
    moved = moved || settled;
  }
  row_end_ = {};  // where nothing was settled
  schedule_.EndWindow(taken_, LatestWindowEnd());
  return moved;
}

// Returns the last row at which the window that begins now may end.
int64_t MixtureComponent::LatestWindowEnd() const {
  const int64_t to_learn = MinSamplesForNoise(problem_);
  if (learns_noise_ && taken_ < to_learn) return to_learn;
  if (learns_noise_ && HandlesOutliers(problem_.problem())) {
    return schedule_.WeightsServeUntil(taken_);
  }
  return std::numeric_limits<int64_t>::max();
}

bool MixtureComponent::Leans() const {
  const Cost cost = expansion_->MakeCost(problem_.problem().regularization);
  return MayLean(cost, expansion_->design(), expansion_->design().reference);
}

// Within a window the posterior may wander to an edge of the region, where it would be cut.
absl::StatusOr<bool> MixtureComponent::MoveIfLeaning(const Stop& stop) {
  bool settled = false;
  if (Leans()) {
    POLYEST_ASSIGN_OR_RETURN(settled, MoveToPosterior(stop, /*may_raise_order=*/false));
  }
  schedule_.PutOffEdges(taken_);
  return settled;
}

// Over a long record the expansion moves while its sums can still be carried over. That is looked
// at halfway between two states that it keeps, when there are rows enough to judge by, and for the
// first time just before the record becomes long.
bool MixtureComponent::LooksAhead() const {
  if (!adaptive() || !schedule_.MayLookAhead(taken_) || !expansion_->kept_state()) return false;
  const int64_t interval = problem_.problem().integration.samples_between_checkpoints;
  if (taken_ <= RowsOfShortRecord(problem_) - interval) return false;
  return taken_ - expansion_->kept_state()->absorbed.rows == std::max<int64_t>(1, interval / 2);
}

absl::StatusOr<bool> MixtureComponent::MoveAheadOfNeed(const Stop& stop) {
  const Cost cost = expansion_->MakeCost(problem_.problem().regularization);
  const double shift = LargestShift(*expansion_, cost.power());
  const bool is_short = taken_ <= RowsOfShortRecord(problem_);
  const bool may_carry = shift <= kMaxCarriedShift || is_short || IsReplayWithheld();
  if (shift < kAheadOfNeed * kMaxCarriedShift || !may_carry) return false;
  POLYEST_ASSIGN_OR_RETURN(const bool settled, MoveToPosterior(stop, /*may_raise_order=*/false,
                                                               /*may_replay=*/is_short));
  if (!settled) schedule_.PutOffLookAhead(taken_);
  return settled;
}

absl::StatusOr<bool> MixtureComponent::RestoreAccuracy(const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const bool moved, MoveWhileInaccurate(stop));
  row_end_.moves = 0;
  return moved;
}

absl::StatusOr<bool> MixtureComponent::MoveWhileInaccurate(const Stop& stop) {
  const auto shift = [&] {
    const Cost cost = expansion_->MakeCost(problem_.problem().regularization);
    return BelievedShift(*expansion_, cost, bisected_);
  };
  const auto accurate = [&] { return shift() <= kAccurateShift; };
  // Each re-expansion may raise the order, so several may be needed.
  for (; row_end_.moves < (automatic_order() ? ReexpansionSchedule::kMaxAttemptsAtRow : 1);
       ++row_end_.moves) {
    const bool follows = accurate();
    if (follows && !Leans()) {
      postponed_.expansion = 0;
      return row_end_.moves > 0;
    }
    POLYEST_ASSIGN_OR_RETURN(const bool settled,
                             MoveToPosterior(stop, /*may_raise_order=*/!follows));
    if (must_divide()) return true;
    if (!settled) break;
  }
  const bool moved = row_end_.moves > 0;
  if (accurate()) return moved;
  if (LookForPieces()) return true;
  const bool waits = moved && problem_.dimension() >= kDimensionToMoveFirst;
  return (!waits && shift() > kMinShiftToBisect && BisectElement()) || moved;
}

ReexpansionRequest MixtureComponent::RequestReexpansion() const {
  ReexpansionRequest request;
  request.problem = &problem_;
  request.store = store_;
  request.rows = taken_;
  request.guesses = particles_;
  request.memory = memory_;
  request.seed = SeedOfReexpansion(reexpansions_tried_);
  request.threads = threads_;
  request.allowance = allowance_;
  return request;
}

// Returns true when the expansion moved or must be divided. Where the sampler has overlooked
// minima, the pieces around them are told apart on the expansion that shows them; only if that is
// not possible does it move to where all of them are. A stop changes nothing, so that what is due
// is found to be due again.
absl::StatusOr<bool> MixtureComponent::MoveToPosterior(const Stop& stop, bool may_raise_order,
                                                       bool may_replay) {
  ReexpansionRequest request = RequestReexpansion();
  request.may_replay = may_replay;
  request.may_raise_order = may_raise_order && !bisected_;
  request.ends_at_overlooked = MayLookForPieces();
  POLYEST_ASSIGN_OR_RETURN(Reexpansion found, Reexpand(*expansion_, request, stop));
  if (!found.overlooked || !request.ends_at_overlooked) return Take(std::move(found));
  const RegionalExpansion& shown = found.moves.expansion ? *found.moves.expansion : *expansion_;
  if (!DivideIntoPieces(shown, found.particles)) {
    request.ends_at_overlooked = false;
    request.seed = SeedOfReexpansion(reexpansions_tried_ + 1);
    POLYEST_ASSIGN_OR_RETURN(
        found, ContinueReexpansion(*expansion_, std::move(found), std::move(request), stop));
    ++reexpansions_tried_;
  }
  return Take(std::move(found)) || must_divide();
}

// Adopts what a re-expansion has found. Returns whether the expansion has moved.
bool MixtureComponent::Take(Reexpansion found) {
  ++reexpansions_tried_;
  particles_ = std::move(found.particles);
  memory_ = std::move(found.memory);
  abandoned_rows_ += found.moves.propagated_rows;
  reexpansions_ += found.moves.reexpansions;
  allowance_ = found.moves.allowance;
  const bool moved = found.moves.expansion != nullptr;
  if (moved && !found.moves.postponed) postponed_.expansion = 0;
  if (found.moves.postponed && postponed_.expansion == 0) postponed_.expansion = taken_;
  if (moved) Adopt(std::move(found.moves.expansion));
  return moved;
}

absl::Status MixtureComponent::MakeComparable(const Stop& stop) {
  if (schedule_.IsComparable(taken_)) return absl::OkStatus();
  POLYEST_RETURN_IF_ERROR(Recover(stop));
  const Cost cost = expansion_->MakeCost(problem_.problem().regularization);
  if (!AgreementWithModel(*expansion_, cost).mean_difference) {
    ReexpansionRequest request = RequestReexpansion();
    request.may_raise_order = false;
    POLYEST_ASSIGN_OR_RETURN(Reexpansion found, Reexpand(*expansion_, request, stop));
    Take(std::move(found));
  }
  schedule_.SetComparable(taken_);
  return absl::OkStatus();
}

// Replaces the present expansion by another one that has taken the same rows.
void MixtureComponent::Adopt(std::unique_ptr<RegionalExpansion> expansion) {
  abandoned_rows_ += expansion_->propagated_rows();
  expansion_ = std::move(expansion);
  broken_ = false;
}

AssessmentRequest MixtureComponent::RequestAssessment() const {
  AssessmentRequest request;
  request.problem = &problem_;
  request.expansion = expansion_.get();
  request.record = &summary_;
  request.guesses = &particles_;
  request.reexpansions = reexpansions_;
  request.propagated_rows = propagated_rows();
  request.last_weight = weight_;
  request.postponed = postponed_;
  return request;
}

}  // namespace polyest::internal
