#include "core/estimator/posterior/mixture_component.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/common/linear_algebra.h"
#include "core/common/status.h"
#include "core/estimator/expansion/leaning.h"
#include "core/estimator/expansion/likelihood_power.h"
#include "core/estimator/expansion/new_runs.h"
#include "core/estimator/expansion/prior_prediction.h"
#include "core/estimator/expansion/reexpansion.h"
#include "core/estimator/posterior/bisection.h"
#include "core/estimator/posterior/misfit.h"
#include "core/estimator/posterior/noise_learning.h"
#include "core/estimator/problem/truncation.h"
#include "core/estimator/record/rows_ahead.h"

namespace polyest::internal {
namespace {

constexpr int64_t kBlockRows = 64;
// A sample whose expansion residual exceeds this fraction of the noise ends the window before it.
constexpr double kResidualToNoise = 0.1;
// At the end of a window the expansion is compared with the model. It is settled again when the
// posterior's means may be wrong by this many standard deviations.
constexpr double kMaxShift = 0.1;
// Pieces are accepted from an expansion that is too inaccurate for further samples, but only while
// it cannot have created or omitted them: the shift must not exceed this value.
constexpr double kMaxShiftInPieces = 1;
constexpr double kWindowGrowth = 1.3;
// The integration error must stay so far below the noise that over a long record it does not
// accumulate to a noticeable share of the posterior's standard deviation. The error is the same at
// every sample's parameters while the noise averages out, so N samples together see errors smaller
// than one sample does by √N: relative tolerance ≤ kTolerancePerNoise × noise ÷ signal ÷ √N,
// counting no fewer than kFewestSamples. The tolerance is checked where windows end, and never goes
// below what double precision supports.
constexpr double kTolerancePerNoise = 1e-4;
constexpr double kFewestSamples = 100;
constexpr double kTightestTolerance = 1e-12;
// After a settlement that did not help, further rows are taken with their discount before the next
// attempt: the record since the windows' beginning, divided by this number.
constexpr int64_t kPatience = 8;
// The region's edges are looked at again after the record since the windows' beginning, divided by
// this number.
constexpr int64_t kLooksPerRecord = 20;
constexpr int kMaxSettlementsAtRow = 4;
// Maximum number of revisions of the noise at the end of a window. A scale that falls from the
// signal's size to 10⁻⁶ of it takes 20 halvings.
constexpr int kMaxRevisions = 24;

// Trajectories that the components may propagate together, and components that they always may be.
constexpr double kMostTrajectories = 2048;
constexpr int kPiecesAtLeast = 4;
// An element is bisected in at most so many dimensions: the number of halves that a posterior
// touches doubles with each of them.
constexpr int kMaxDimensionToBisect = 3;
// At the end of a window an element is bisected when the posterior's means may be wrong by so many
// standard deviations and moving has not helped.
constexpr double kMinShiftToBisect = 0.25;

// Returns the particles' mean and spread, by which outliers are judged once the posterior is known.
PosteriorSummary SummaryOf(const Matrix& particles) {
  PosteriorSummary summary;
  summary.centre = particles.colwise().mean().transpose();
  const Matrix centred = particles.rowwise() - summary.centre.transpose();
  const SymmetricEigen eigen =
      DecomposeSymmetric(centred.transpose() * centred / static_cast<double>(particles.rows()));
  summary.factor = eigen.vectors * eigen.values.cwiseMax(0).cwiseSqrt().asDiagonal();
  return summary;
}

}  // namespace

int64_t NextWindow(int64_t rows, int64_t from) {
  const auto window = static_cast<double>(rows - from);
  return std::max(rows + 2, from + static_cast<int64_t>(std::ceil(kWindowGrowth * window)));
}

int MostComponents(const ResolvedProblem& problem) {
  const ExpansionOptions& options = problem.problem().expansion;
  const int n = problem.dimension();
  const auto terms = TermCount(n, FirstTruncation(options, n), kMaxTerms);
  const double points = options.points_per_term * static_cast<double>(terms);
  return std::max(kPiecesAtLeast, static_cast<int>(kMostTrajectories / points));
}

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
  component->room_ = MostComponents(problem);
  return component;
}

absl::Status MixtureComponent::TakeUpTo(int64_t rows, const Stop& stop) {
  if (must_divide()) return absl::OkStatus();
  POLYEST_RETURN_IF_ERROR(Recover(stop));
  // An earlier stop may have left the end of a window unprocessed.
  POLYEST_RETURN_IF_ERROR(FinishRow(stop).status());
  RowBlock block;
  while (taken_ < rows && !must_divide()) {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    POLYEST_RETURN_IF_ERROR(ReadBlock(rows, block, stop));
    broken_ = true;
    POLYEST_RETURN_IF_ERROR(expansion_->Propagate(block, stop));
    POLYEST_ASSIGN_OR_RETURN(const bool through, AbsorbBlock(block, stop));
    if (through) broken_ = false;
  }
  return absl::OkStatus();
}

// Reads the next rows, up to the first `rows` of the store, as far as the runs' parameters exist.
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

// Replays the record so far with the parameters of the new run, which are as uncertain as their
// prior.
absl::Status MixtureComponent::BeginRun(int run, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem grown, problem_.WithRuns(run + 1));
  POLYEST_ASSIGN_OR_RETURN(ExpansionDesign design, DesignForNewRuns(grown, expansion_->design()));
  LearnedNoise noise = expansion_->noise();
  noise.posterior = SummaryForNewRuns(grown, noise.posterior);
  noise.centre.resize(0);
  Matrix particles = ParticlesForNewRuns(grown, particles_);
  std::swap(problem_, grown);  // the object stays in place, since expansions refer to it
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

// After a stop in the middle of a block, propagates the same expansion again up to the last row
// taken.
absl::Status MixtureComponent::Recover(const Stop& stop) {
  if (!broken_) return absl::OkStatus();
  POLYEST_ASSIGN_OR_RETURN(expansion_, Replay(problem_, expansion_->design(), expansion_->noise(),
                                              *store_, taken_, threads_, stop));
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
    const bool coarse = !short_of_trajectories && taken_ >= patient_until_ &&
                        expansion_->ResidualToNoise(row) > CoarseResidual();
    if (short_of_trajectories || (adaptive() && coarse)) {
      POLYEST_ASSIGN_OR_RETURN(const bool moved, SettleBefore(row, stop));
      if (moved) return false;
      too_coarse = !short_of_trajectories && MayBisect();
    }
    expansion_->Absorb(row);
    summary_.Add(block, row, problem_.channels());
    AddPredictionsOf(*expansion_, row, summary_);
    ++taken_;
    contracts_ = too_coarse;
    POLYEST_ASSIGN_OR_RETURN(const bool moved, FinishRow(stop));
    if (moved) return false;
  }
  return true;
}

// Does what is due after the last row taken, all of which may be done again after a stop. Returns
// true when the expansion has moved or must be divided.
absl::StatusOr<bool> MixtureComponent::FinishRow(const Stop& stop) {
  bool moved = false;
  if (contracts_) {
    POLYEST_ASSIGN_OR_RETURN(moved, ContractOrBisect(stop));
    contracts_ = false;
  }
  if (must_divide()) return true;
  bool settled = false;
  if (WindowEnds()) {
    POLYEST_ASSIGN_OR_RETURN(settled, SettleAfterWindow(stop));
  } else if (LooksAtEdges()) {
    POLYEST_ASSIGN_OR_RETURN(settled, SettleIfLeaning(stop));
  }
  return moved || settled;
}

// Handles a next row at which the present expansion is too coarse or too few trajectories are left.
absl::StatusOr<bool> MixtureComponent::SettleBefore(int row, const Stop& stop) {
  const bool short_of_trajectories = row == expansion_->fitted_rows();
  if (settled_row_ != taken_) settlements_at_row_ = 0;
  settled_row_ = taken_;
  if (adaptive() && taken_ > 0 && settlements_at_row_ < kMaxSettlementsAtRow) {
    POLYEST_ASSIGN_OR_RETURN(const bool moved, Settle(stop, !short_of_trajectories));
    ++settlements_at_row_;
    if (moved) return true;
  }
  if (LookForPieces()) return true;
  if (short_of_trajectories) {
    if (BisectElement()) return true;
    return expansion_->shortage();
  }
  if (MayBisect()) return false;
  patient_until_ = taken_ + 1 + (taken_ - windows_from_) / kPatience;
  return false;
}

// The residual of the expansion from which on it is too coarse, in units of the stated noise.
double MixtureComponent::CoarseResidual() const {
  return kResidualToNoise * std::sqrt(expansion_->noise().misfit);
}

void MixtureComponent::ReviseMisfit(const Stop& stop) {
  expansion_->set_misfit(Misfit(problem_, *expansion_, stop));
}

absl::StatusOr<bool> MixtureComponent::SettleAfterWindow(const Stop& stop) {
  bool moved = false;
  if (learns_noise_) {
    POLYEST_ASSIGN_OR_RETURN(moved, LearnNoise(stop));
  }
  if (adaptive()) {
    ReviseMisfit(stop);
    POLYEST_ASSIGN_OR_RETURN(const bool tightened, TightenTolerance(stop));
    POLYEST_ASSIGN_OR_RETURN(const bool settled, SettleIfInaccurate(stop));
    if (settled) ReviseMisfit(stop);
    moved = moved || tightened || settled;
  }
  window_end_ = NextWindow(taken_, windows_from_);
  edges_row_ = NextLook();
  return moved;
}

int64_t MixtureComponent::NextLook() const {
  return taken_ + 1 + (taken_ - windows_from_) / kLooksPerRecord;
}

bool MixtureComponent::Leans() const {
  const Cost cost = expansion_->MakeCost(problem_.problem().regularization);
  return MayLean(cost, expansion_->design(), expansion_->design().reference);
}

// Within a window the posterior may wander to an edge of the region, where it would be cut.
absl::StatusOr<bool> MixtureComponent::SettleIfLeaning(const Stop& stop) {
  bool settled = false;
  if (Leans()) {
    POLYEST_ASSIGN_OR_RETURN(settled, Settle(stop, /*may_raise_order=*/false));
  }
  edges_row_ = NextLook();
  return settled;
}

absl::StatusOr<bool> MixtureComponent::SettleIfInaccurate(const Stop& stop) {
  const auto shift = [&] {
    const Cost cost = expansion_->MakeCost(problem_.problem().regularization);
    return bisected_ && !expansion_->design().checks_are_draws
               ? LargestShift(*expansion_, cost)
               : AgreementWithModel(*expansion_, cost).shift;
  };
  const auto accurate = [&] { return shift() <= kMaxShift; };
  bool moved = false;
  // Each settlement may raise the order, so several may be needed.
  for (int i = 0; i < (automatic_order() ? kMaxSettlementsAtRow : 1); ++i) {
    const bool follows = accurate();
    if (follows && !Leans()) return moved;
    POLYEST_ASSIGN_OR_RETURN(const bool settled, Settle(stop, /*may_raise_order=*/!follows));
    if (!settled) break;
    moved = true;
  }
  if (accurate()) return moved;
  return LookForPieces() || (shift() > kMinShiftToBisect && BisectElement()) || moved;
}

// Returns true when the posterior is in pieces on the present expansion, which no move makes
// accurate. Does not look for pieces before the noise is learned, because the noise would decide
// between them.
bool MixtureComponent::LookForPieces() {
  if (!adaptive() || taken_ < whole_until_ || room_ < 2) return false;
  for (size_t c = 0; c < expansion_->noise().channels.size(); ++c) {
    const bool unknown = problem_.problem().measured[c].noise.unknown;
    if (unknown && !expansion_->noise().channels[c].learned) return false;
  }
  const Cost cost = expansion_->MakeCost(problem_.problem().regularization);
  if (AgreementWithModel(*expansion_, cost).shift > kMaxShiftInPieces) return false;
  std::vector<Piece> pieces = FindPieces(cost, expansion_->design(), particles_);
  if (pieces.size() > 1) pieces_ = std::move(pieces);
  return must_divide();
}

bool MixtureComponent::MayBisect() const {
  return adaptive() && taken_ >= whole_until_ && room_ > 1 &&
         problem_.dimension() <= kMaxDimensionToBisect;
}

// Returns true when the element is to be bisected.
bool MixtureComponent::BisectElement() {
  if (!MayBisect()) return false;
  pieces_ = Bisect(*expansion_, particles_);
  halves_ = true;
  return true;
}

// After a row that the expansion does not follow, which has been taken with its discount: if the
// posterior contracts as far as the collocation points confirm it, the expansion moves there. That
// costs far less than elements, but leaves separate modes where they are.
absl::StatusOr<bool> MixtureComponent::ContractOrBisect(const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const bool moved, Settle(stop, /*may_raise_order=*/false));
  return moved || BisectElement();
}

absl::StatusOr<std::vector<std::unique_ptr<MixtureComponent>>> MixtureComponent::Divide(
    const Stop& stop) {
  std::vector<std::unique_ptr<MixtureComponent>> parts;
  const int room = std::max(1, room_ / static_cast<int>(pieces_.size()));
  for (const Piece& piece : pieces_) {
    std::unique_ptr<MixtureComponent> part(new MixtureComponent(problem_, store_, threads_));
    const absl::Status begun = part->BeginOn(*this, piece, stop);
    if (absl::IsFailedPrecondition(begun)) {
      pieces_.clear();
      halves_ = false;
      whole_until_ = NextWindow(taken_, windows_from_);
      parts.clear();
      return parts;
    }
    POLYEST_RETURN_IF_ERROR(begun);
    part->room_ = room;
    parts.push_back(std::move(part));
  }
  return parts;
}

absl::StatusOr<std::unique_ptr<MixtureComponent>> MixtureComponent::Unite(const Piece& whole,
                                                                          const Stop& stop) const {
  std::unique_ptr<MixtureComponent> united(new MixtureComponent(problem_, store_, threads_));
  const absl::Status begun = united->ExpandOn(*this, whole, stop);
  if (absl::IsFailedPrecondition(begun)) return nullptr;
  POLYEST_RETURN_IF_ERROR(begun);
  united->whole_until_ = 0;
  united->bisected_ = false;
  const Cost cost = united->expansion_->MakeCost(problem_.problem().regularization);
  if (!(LargestShift(*united->expansion_, cost) <= kMinShiftToBisect)) return nullptr;
  return united;
}

// Returns the design over the piece's region. Its check points are particles of the piece, or cover
// the region if the particles' density is unknown.
ExpansionDesign MixtureComponent::DesignOn(const MixtureComponent& parent,
                                           const Piece& piece) const {
  const ExpansionDesign& before = parent.expansion_->design();
  const Vector middle = piece.particles.rows() > 0
                            ? Vector(piece.particles.colwise().mean().transpose())
                            : NearestInside(problem_.prior(), piece.region.centre());
  ExpansionDesign design =
      DesignForRegion(problem_, before.basis->truncation(), piece.region, middle);
  design.element = piece.element;
  if (piece.costs.size() == 0) {
    SpreadCheckPoints(problem_, middle, design);
    return design;
  }
  const Eigen::Index count = std::min(before.check_points.rows(), piece.particles.rows());
  design.check_points = design.region.ManyToLocal(piece.particles.topRows(count));
  design.check_costs = piece.costs.head(count);
  design.checks_are_draws = true;
  return design;
}

// Starts at the parent's row, over the region of one of the parent's pieces.
absl::Status MixtureComponent::ExpandOn(const MixtureComponent& parent, const Piece& piece,
                                        const Stop& stop) {
  taken_ = window_end_ = parent.taken_;
  windows_from_ = parent.windows_from_;
  summary_ = parent.summary_;
  settlements_ = parent.settlements_;
  bisected_ = parent.bisected_ || parent.halves_;
  if (!parent.halves_) whole_until_ = NextWindow(taken_, windows_from_);
  particles_ = piece.particles;
  LearnedNoise noise = parent.expansion_->noise();
  if (noise.posterior.centre.size() > 0 && particles_.rows() > problem_.dimension()) {
    noise.posterior = SummaryOf(particles_);
  }
  POLYEST_ASSIGN_OR_RETURN(expansion_, Replay(problem_, DesignOn(parent, piece), std::move(noise),
                                              *store_, taken_, threads_, stop));
  ++reexpansions_;
  return absl::OkStatus();
}

// As ExpandOn, and moves the expansion to the piece's posterior.
absl::Status MixtureComponent::BeginOn(const MixtureComponent& parent, const Piece& piece,
                                       const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(ExpandOn(parent, piece, stop));
  bool moved = !parent.halves_;
  for (int i = 0; moved && i < kMaxSettlementsAtRow; ++i) {
    POLYEST_ASSIGN_OR_RETURN(moved, Settle(stop, /*may_raise_order=*/true));
  }
  return absl::OkStatus();
}

// Raises scales that are not learned yet with the signal, so the first samples have little weight
// however large they are. Returns true when the record was replayed.
absl::StatusOr<bool> MixtureComponent::RaiseUnlearnedScales(const RowBlock& block, int row,
                                                            const Stop& stop) {
  if (!learns_noise_) return false;
  std::optional<LearnedNoise> raised;  // set only when needed: this runs for every sample
  const std::vector<ChannelNoise>& present = expansion_->noise().channels;
  const size_t width = block.values.size() / block.rows.size();
  for (size_t c = 0; c < present.size(); ++c) {
    const double shape = block.noise[static_cast<size_t>(row) * present.size() + c];
    if (!problem_.problem().measured[c].noise.unknown || present[c].learned || shape <= 0) continue;
    const double value = std::abs(block.values[static_cast<size_t>(row) * width + c]);
    const double predicted = expansion_->Magnitude(row, static_cast<int>(c));
    const std::optional<double> scale =
        UnlearnedScale(summary_, c, value / shape, predicted / shape, present[c].scale);
    if (!scale) continue;
    if (!raised) raised = expansion_->noise();
    raised->channels[c].scale = *scale;
  }
  if (!raised) return false;
  POLYEST_RETURN_IF_ERROR(Reweigh(*std::move(raised), stop));
  return true;
}

// Returns whether the record was reweighed with another noise. Smaller noise requires a more
// accurate expansion.
absl::StatusOr<bool> MixtureComponent::LearnNoise(const Stop& stop) {
  bool moved = false;
  for (int i = 0; i < kMaxRevisions; ++i) {
    POLYEST_RETURN_IF_ERROR(stop.Check());
    std::optional<LearnedNoise> revised = ReviseNoise(problem_, *expansion_, summary_, stop);
    if (!revised) break;
    POLYEST_RETURN_IF_ERROR(Reweigh(*std::move(revised), stop));
    moved = true;
    if (!adaptive()) continue;
    POLYEST_RETURN_IF_ERROR(TightenTolerance(stop).status());
    POLYEST_RETURN_IF_ERROR(SettleIfInaccurate(stop).status());
  }
  return moved;
}

// Propagates the expansion along the record so far again, with the samples weighed by `noise`.
absl::Status MixtureComponent::Reweigh(LearnedNoise noise, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(auto replayed, Replay(problem_, expansion_->design(), std::move(noise),
                                                 *store_, taken_, threads_, stop));
  Adopt(std::move(replayed));
  return absl::OkStatus();
}

// Returns true when the noise required a tighter tolerance and the record was propagated again with
// it.
absl::StatusOr<bool> MixtureComponent::TightenTolerance(const Stop& stop) {
  if (!problem_.problem().tolerance_follows_noise) return false;
  const double samples = std::max(kFewestSamples, static_cast<double>(summary_.samples()));
  const double needed = std::max(
      kTightestTolerance,
      kTolerancePerNoise * summary_.NoiseToSignal(expansion_->noise()) / std::sqrt(samples));
  const double present = problem_.problem().integration.relative_tolerance;
  if (needed >= present || expansion_->StepsExactly()) return false;
  // Half of the needed tolerance is taken, so that a slowly falling ratio does not cause frequent
  // replays: four times as many samples come before the next.
  problem_.set_relative_tolerance(std::max(kTightestTolerance, 0.5 * needed));
  auto replayed =
      Replay(problem_, expansion_->design(), expansion_->noise(), *store_, taken_, threads_, stop);
  if (!replayed.ok()) {
    problem_.set_relative_tolerance(present);
    if (absl::IsFailedPrecondition(replayed.status())) return false;  // the present expansion stays
    return replayed.status();
  }
  Adopt(*std::move(replayed));
  return true;
}

// Returns true when the expansion moved.
absl::StatusOr<bool> MixtureComponent::Settle(const Stop& stop, bool may_raise_order) {
  SettleRequest request;
  request.may_raise_order = may_raise_order && !bisected_;
  request.problem = &problem_;
  request.store = store_;
  request.rows = taken_;
  request.guesses = particles_;
  request.seed = 1000 * (settlements_ + 1);
  request.threads = threads_;
  POLYEST_ASSIGN_OR_RETURN(Settlement settlement,
                           polyest::internal::Settle(*expansion_, request, stop));
  ++settlements_;
  particles_ = std::move(settlement.particles);
  if (!settlement.expansion) return false;
  abandoned_rows_ += settlement.propagated_rows;
  reexpansions_ += settlement.reexpansions;
  Adopt(std::move(settlement.expansion));
  return true;
}

absl::Status MixtureComponent::MakeComparable(const Stop& stop) {
  if (comparable_row_ == taken_) return absl::OkStatus();
  POLYEST_RETURN_IF_ERROR(Recover(stop));
  const Cost cost = expansion_->MakeCost(problem_.problem().regularization);
  if (!AgreementWithModel(*expansion_, cost).mean_difference) {
    POLYEST_RETURN_IF_ERROR(Settle(stop, /*may_raise_order=*/false).status());
  }
  comparable_row_ = taken_;
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
  return request;
}

}  // namespace polyest::internal
