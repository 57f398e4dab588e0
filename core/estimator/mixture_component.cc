#include "core/estimator/mixture_component.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/common/status.h"
#include "core/estimator/new_runs.h"
#include "core/estimator/noise_learning.h"
#include "core/estimator/reexpansion.h"

namespace polyest {
namespace {

constexpr int64_t kBlockRows = 64;
// A sample whose expansion residual passes this part of the noise ends the window before it.
constexpr double kResidualToNoise = 0.1;
// Where a window ends the expansion is compared with the model: it is settled anew when the
// posterior's means may be off by this many of its standard deviations.
constexpr double kMostShift = 0.1;
constexpr double kWindowGrowth = 1.3;
// The integration error must stay so far below the noise that it does not add up over a long
// record to a share of the posterior's standard deviation: relative tolerance ≤ this × noise ÷
// signal, looked at where windows end; never tighter than double precision bears.
constexpr double kTolerancePerNoise = 1e-5;
constexpr double kTightestTolerance = 1e-12;
// After a settlement that did not help, this part of the record so far is taken with its discount
// before the next one is tried.
constexpr int64_t kPatience = 8;
constexpr int kMostSettlementsAtRow = 4;
// Of the noise, where a window ends. A scale that falls from the signal's size to 10⁻⁶ of it takes
// 20 halvings.
constexpr int kMostRevisions = 24;
// By how much a scale not learned yet exceeds the largest sample.
constexpr double kAboveSignal = 2;

}  // namespace

MixtureComponent::MixtureComponent(const ResolvedProblem& problem, const SampleStore* store,
                                   int threads)
    : problem_(problem),
      store_(store),
      threads_(threads),
      learns_noise_(LearnsNoise(problem_.problem())),
      particles_(0, problem_.dimension()) {}

absl::StatusOr<std::unique_ptr<MixtureComponent>> MixtureComponent::OfPrior(
    const ResolvedProblem& problem, const SampleStore* store, int threads) {
  std::unique_ptr<MixtureComponent> component(new MixtureComponent(problem, store, threads));
  POLYEST_ASSIGN_OR_RETURN(ExpansionDesign design, DesignForPrior(component->problem_));
  POLYEST_ASSIGN_OR_RETURN(component->expansion_,
                           RegionalExpansion::Make(component->problem_, std::move(design),
                                                   NoiseToBeginWith(problem.problem()), threads));
  return component;
}

absl::Status MixtureComponent::TakeUpTo(int64_t rows, const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(Recover(stop));
  // A window's end that an earlier stop left open.
  if (WindowEnds()) POLYEST_RETURN_IF_ERROR(SettleAfterWindow(stop).status());
  RowBlock block;
  while (taken_ < rows) {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    POLYEST_RETURN_IF_ERROR(ReadBlock(rows, block, stop));
    broken_ = true;
    POLYEST_RETURN_IF_ERROR(expansion_->Propagate(block, stop));
    POLYEST_ASSIGN_OR_RETURN(const bool through, AbsorbBlock(block, stop));
    if (through) broken_ = false;
  }
  return absl::OkStatus();
}

// The next rows, up to the first `rows` of the store, for which there are parameters.
absl::Status MixtureComponent::ReadBlock(int64_t rows, RowBlock& block, const Stop& stop) {
  const int64_t count = std::min(kBlockRows, rows - taken_);
  const auto read = [&](int64_t some) {
    return ReadWithRowsAhead(*store_, taken_, some, problem_.knots_ahead(), block);
  };
  POLYEST_RETURN_IF_ERROR(read(count));
  if (!problem_.per_run()) return absl::OkStatus();
  if (block.rows.front().run >= problem_.runs()) {
    POLYEST_RETURN_IF_ERROR(BeginRun(block.rows.front().run, stop));
  }
  int64_t known = 0;
  while (known < count && block.rows[static_cast<size_t>(known)].run < problem_.runs()) ++known;
  return known < count ? read(known) : absl::OkStatus();
}

// The record so far, with the parameters that the run brings: as unknown as their prior.
absl::Status MixtureComponent::BeginRun(int run, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem grown, problem_.WithRuns(run + 1));
  POLYEST_ASSIGN_OR_RETURN(ExpansionDesign design, DesignForNewRuns(grown, expansion_->design()));
  LearnedNoise noise = expansion_->noise();
  noise.posterior = SummaryForNewRuns(grown, noise.posterior);
  Matrix particles = ParticlesForNewRuns(grown, particles_);
  std::swap(problem_, grown);  // in its place, since expansions refer to it
  auto replayed =
      Replay(problem_, std::move(design), std::move(noise), *store_, taken_, threads_, stop);
  if (!replayed.ok()) {
    std::swap(problem_, grown);
    return replayed.status();
  }
  Adopt(*std::move(replayed));
  particles_ = std::move(particles);
  windows_from_ = patient_until_ = taken_;
  window_end_ = taken_ + 2;
  return absl::OkStatus();
}

// After a stop in the middle of a block: the same expansion, propagated again up to the last row
// taken.
absl::Status MixtureComponent::Recover(const Stop& stop) {
  if (!broken_) return absl::OkStatus();
  POLYEST_ASSIGN_OR_RETURN(expansion_, Replay(problem_, expansion_->design(), expansion_->noise(),
                                              *store_, taken_, threads_, stop));
  broken_ = false;
  return absl::OkStatus();
}

// False when the expansion moved and the rest of the block must be propagated again.
absl::StatusOr<bool> MixtureComponent::AbsorbBlock(const RowBlock& block, const Stop& stop) {
  for (int row = 0; row < block.count(); ++row) {
    POLYEST_ASSIGN_OR_RETURN(const bool raised, RaiseUnlearnedScales(block, row, stop));
    if (raised) return false;
    const bool short_of_trajectories = row == expansion_->fitted_rows();
    const bool coarse = !short_of_trajectories && taken_ >= patient_until_ &&
                        expansion_->ResidualToNoise(row) > kResidualToNoise;
    if (short_of_trajectories || (adaptive() && coarse)) {
      POLYEST_ASSIGN_OR_RETURN(const bool moved, SettleBefore(short_of_trajectories, stop));
      if (moved) return false;
    }
    expansion_->Absorb(row);
    summary_.Add(block, row, problem_.channels());
    ++taken_;
    if (WindowEnds()) {
      POLYEST_ASSIGN_OR_RETURN(const bool moved, SettleAfterWindow(stop));
      if (moved) return false;
    }
  }
  return true;
}

// The next row is too coarse for the present expansion, or too few trajectories reach it.
absl::StatusOr<bool> MixtureComponent::SettleBefore(bool short_of_trajectories, const Stop& stop) {
  if (settled_row_ != taken_) settlements_at_row_ = 0;
  settled_row_ = taken_;
  if (adaptive() && taken_ > 0 && settlements_at_row_ < kMostSettlementsAtRow) {
    POLYEST_ASSIGN_OR_RETURN(const bool moved, Settle(stop, !short_of_trajectories));
    ++settlements_at_row_;
    if (moved) return true;
  }
  if (short_of_trajectories) return expansion_->shortage();
  patient_until_ = taken_ + 1 + (taken_ - windows_from_) / kPatience;
  return false;
}

absl::StatusOr<bool> MixtureComponent::SettleAfterWindow(const Stop& stop) {
  bool moved = false;
  if (learns_noise_) {
    POLYEST_ASSIGN_OR_RETURN(moved, LearnNoise(stop));
  }
  if (adaptive()) {
    POLYEST_ASSIGN_OR_RETURN(const bool tightened, TightenTolerance(stop));
    POLYEST_ASSIGN_OR_RETURN(const bool settled, SettleIfInaccurate(stop));
    moved = moved || tightened || settled;
  }
  const auto window = static_cast<double>(taken_ - windows_from_);
  window_end_ =
      std::max(taken_ + 2, windows_from_ + static_cast<int64_t>(std::ceil(kWindowGrowth * window)));
  return moved;
}

absl::StatusOr<bool> MixtureComponent::SettleIfInaccurate(const Stop& stop) {
  bool moved = false;
  // Each settlement may raise the order by one.
  for (int i = 0; i < (automatic_order() ? kMostSettlementsAtRow : 1); ++i) {
    const Agreement agreement =
        AgreementWithModel(*expansion_, expansion_->MakeCost(problem_.problem().regularization));
    if (agreement.shift <= kMostShift) break;
    POLYEST_ASSIGN_OR_RETURN(const bool settled, Settle(stop, /*may_raise_order=*/true));
    if (!settled) break;
    moved = true;
  }
  return moved;
}

// Scales that are not learned yet follow the signal, so that the first samples weigh little however
// large they are. True when the record was taken anew.
absl::StatusOr<bool> MixtureComponent::RaiseUnlearnedScales(const RowBlock& block, int row,
                                                            const Stop& stop) {
  if (!learns_noise_) return false;
  std::optional<LearnedNoise> raised;  // made only when needed: this is done for every sample
  const std::vector<ChannelNoise>& present = expansion_->noise().channels;
  const size_t width = block.values.size() / block.rows.size();
  for (size_t c = 0; c < present.size(); ++c) {
    const double shape = block.noise[static_cast<size_t>(row) * present.size() + c];
    if (!problem_.problem().measured[c].noise.unknown || present[c].learned || shape <= 0) continue;
    const double size = std::abs(block.values[static_cast<size_t>(row) * width + c]) / shape;
    if (size <= present[c].scale) continue;
    if (!raised) raised = expansion_->noise();
    raised->channels[c].scale = kAboveSignal * size;
  }
  if (!raised) return false;
  POLYEST_RETURN_IF_ERROR(TakeAnew(*std::move(raised), stop));
  return true;
}

// True when the record was taken anew with another noise. Less noise asks more of the expansion.
absl::StatusOr<bool> MixtureComponent::LearnNoise(const Stop& stop) {
  bool moved = false;
  for (int i = 0; i < kMostRevisions; ++i) {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    std::optional<LearnedNoise> revised = ReviseNoise(problem_, *expansion_, summary_, stop);
    if (!revised) break;
    POLYEST_RETURN_IF_ERROR(TakeAnew(*std::move(revised), stop));
    moved = true;
    if (!adaptive()) continue;
    POLYEST_RETURN_IF_ERROR(TightenTolerance(stop).status());
    POLYEST_RETURN_IF_ERROR(SettleIfInaccurate(stop).status());
  }
  return moved;
}

// The same expansion with the record so far weighed by another noise.
absl::Status MixtureComponent::TakeAnew(LearnedNoise noise, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(auto replayed, Replay(problem_, expansion_->design(), std::move(noise),
                                                 *store_, taken_, threads_, stop));
  Adopt(std::move(replayed));
  return absl::OkStatus();
}

// True when the noise asked for a tighter tolerance and the record was propagated again with it.
absl::StatusOr<bool> MixtureComponent::TightenTolerance(const Stop& stop) {
  if (!problem_.problem().tolerance_follows_noise) return false;
  const double needed = std::max(kTightestTolerance,
                                 kTolerancePerNoise * summary_.NoiseToSignal(expansion_->noise()));
  const double present = problem_.problem().integration.relative_tolerance;
  if (needed >= present) return false;
  // Half of what is needed now, so that a slowly falling ratio does not ask again and again.
  problem_.set_relative_tolerance(std::max(kTightestTolerance, 0.5 * needed));
  auto replayed =
      Replay(problem_, expansion_->design(), expansion_->noise(), *store_, taken_, threads_, stop);
  if (!replayed.ok()) {
    problem_.set_relative_tolerance(present);
    if (absl::IsFailedPrecondition(replayed.status())) return false;  // the present one stays
    return replayed.status();
  }
  Adopt(*std::move(replayed));
  return true;
}

// True when the expansion moved.
absl::StatusOr<bool> MixtureComponent::Settle(const Stop& stop, bool may_raise_order) {
  SettleRequest request;
  request.may_raise_order = may_raise_order;
  request.problem = &problem_;
  request.store = store_;
  request.rows = taken_;
  request.guesses = particles_;
  request.seed = 1000 * (settlements_ + 1);
  request.threads = threads_;
  POLYEST_ASSIGN_OR_RETURN(Settlement settlement, polyest::Settle(*expansion_, request, stop));
  ++settlements_;
  particles_ = std::move(settlement.particles);
  if (!settlement.expansion) return false;
  abandoned_rows_ += settlement.propagated_rows;
  reexpansions_ += settlement.reexpansions;
  Adopt(std::move(settlement.expansion));
  return true;
}

// The present expansion is given up for another one that has taken the same rows.
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
  request.propagated_rows = abandoned_rows_ + expansion_->propagated_rows();
  return request;
}

}  // namespace polyest
