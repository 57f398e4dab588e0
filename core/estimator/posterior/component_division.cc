// Divides a mixture component into pieces of its posterior or halves of its element, and unites
// what one expansion serves.

#include <algorithm>
#include <utility>

#include "core/common/infeasible.h"
#include "core/common/status.h"
#include "core/estimator/expansion/germ_summary.h"
#include "core/estimator/expansion/reexpansion.h"
#include "core/estimator/expansion/replay.h"
#include "core/estimator/posterior/bisection.h"
#include "core/estimator/posterior/least_linear.h"
#include "core/estimator/posterior/mixture_component.h"
#include "core/estimator/problem/truncation.h"

namespace polyest::internal {
namespace {

// Pieces are accepted from an expansion that is too inaccurate for further samples, but only while
// it cannot have created or omitted them: the shift must not exceed this value.
constexpr double kMaxShiftInPieces = 1;
// Trajectories that the components may propagate together, and components that they always may be.
constexpr double kMaxTrajectories = 2048;
constexpr int kPiecesAtLeast = 4;
// An element is bisected in at most so many dimensions: the number of halves that a posterior
// touches doubles with each of them.
constexpr int kMaxDimensionToBisect = 4;

// Returns the particles' mean and spread, by which outliers are judged once the posterior is known.
PosteriorSummary PosteriorOf(const Matrix& particles) {
  GermSummary summary = SummaryOf(particles);
  return {.centre = std::move(summary.mean), .factor = FactorOf(summary.covariance)};
}

}  // namespace

int MaxComponents(const ResolvedProblem& problem) {
  const ExpansionOptions& options = problem.problem().expansion;
  const int n = problem.dimension();
  const auto terms = TermCount(n, FirstTruncation(options, n), kMaxTerms);
  const double points = PointCount(options, static_cast<double>(terms));
  return std::max(kPiecesAtLeast, static_cast<int>(kMaxTrajectories / points));
}

// Pieces are not looked for before the noise is learned, because the noise would decide between
// them.
bool MixtureComponent::MayLookForPieces() const {
  if (!adaptive() || schedule_.StaysWhole(taken_) || room_ < 2 || IsReplayWithheld()) return false;
  for (size_t c = 0; c < expansion_->noise().channels.size(); ++c) {
    const bool unknown = problem_.problem().measured[c].noise.unknown;
    if (unknown && !expansion_->noise().channels[c].learned) return false;
  }
  return true;
}

// Divides the component if the particles and the cost on the expansion are in pieces. Returns
// whether it must be divided, for this reason or an earlier one.
bool MixtureComponent::DivideIntoPieces(const RegionalExpansion& expansion,
                                        const Matrix& particles) {
  const Cost cost = expansion.MakeCost(problem_.problem().regularization);
  std::vector<Piece> pieces = FindPieces(cost, expansion.design(), particles);
  if (pieces.size() > 1) pieces_ = std::move(pieces);
  return must_divide();
}

// Returns true when the posterior is in pieces on the present expansion, which no move makes
// accurate.
bool MixtureComponent::LookForPieces() {
  if (!MayLookForPieces()) return false;
  const Cost cost = expansion_->MakeCost(problem_.problem().regularization);
  return AgreementWithModel(*expansion_, cost).shift <= kMaxShiftInPieces &&
         DivideIntoPieces(*expansion_, particles_);
}

bool MixtureComponent::MayBisect() const {
  return adaptive() && !schedule_.StaysWhole(taken_) && room_ > 1 && !IsReplayWithheld() &&
         problem_.dimension() <= kMaxDimensionToBisect;
}

// Returns true when the element is to be bisected.
bool MixtureComponent::BisectElement() {
  halves_ = MayBisect();
  return halves_;
}

// Finds the halves of an element that is to be bisected.
absl::Status MixtureComponent::Halve(const Stop& stop) {
  LeastLinear found;
  if (expansion_->absorbed_rows() > 0 && !HasTermsOfTheModel(*expansion_)) {
    POLYEST_ASSIGN_OR_RETURN(
        found, FindLeastLinear(problem_, *expansion_, *store_, taken_, threads_, stop));
    abandoned_rows_ += found.propagated_rows;
    allowance_.Use(taken_, taken_);
  }
  pieces_ = Bisect(*expansion_, found.germ, particles_);
  return absl::OkStatus();
}

// After a row that the expansion does not follow, which has been taken with its discount: if the
// posterior contracts as far as the collocation points confirm it, the expansion moves there. That
// costs far less than elements, but leaves separate modes where they are.
absl::StatusOr<bool> MixtureComponent::ContractOrBisect(const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const bool moved, MoveToPosterior(stop, /*may_raise_order=*/false));
  return moved || BisectElement();
}

absl::StatusOr<std::vector<std::unique_ptr<MixtureComponent>>> MixtureComponent::Divide(
    const Stop& stop) {
  if (pieces_.empty()) POLYEST_RETURN_IF_ERROR(Halve(stop));
  std::vector<std::unique_ptr<MixtureComponent>> parts;
  const int room = std::max(1, room_ / static_cast<int>(pieces_.size()));
  for (const Piece& piece : pieces_) {
    std::unique_ptr<MixtureComponent> part(new MixtureComponent(problem_, store_, threads_));
    const absl::Status begun = part->BeginOn(*this, piece, stop);
    if (IsInfeasible(begun)) {
      pieces_.clear();
      halves_ = false;
      schedule_.StayWhole(taken_);
      parts.clear();
      allowance_.Use(taken_, taken_);
      return parts;
    }
    POLYEST_RETURN_IF_ERROR(begun);
    part->room_ = room;
    parts.push_back(std::move(part));
  }
  return parts;
}

absl::StatusOr<std::unique_ptr<MixtureComponent>> MixtureComponent::Unite(const Piece& whole,
                                                                          const Stop& stop) {
  if (IsReplayWithheld()) return nullptr;
  std::unique_ptr<MixtureComponent> united(new MixtureComponent(problem_, store_, threads_));
  const absl::Status begun = united->ExpandOn(*this, whole, stop);
  if (!begun.ok() && !IsInfeasible(begun)) return begun;
  allowance_.Use(taken_, taken_);
  if (!begun.ok()) return nullptr;
  united->schedule_.AllowDivision();
  united->bisected_ = false;
  const Cost cost = united->expansion_->MakeCost(problem_.problem().regularization);
  if (!(LargestShift(*united->expansion_, cost.power()) <= kMinShiftToBisect)) return nullptr;
  return united;
}

void MixtureComponent::set_element(Element element) {
  if (element.bounds().size() == this->element().bounds().size()) return;
  bisected_ = bisected_ && !element.bounds().empty();
  expansion_->set_element(std::move(element));
  schedule_.LookAtEdgesAt(taken_);  // some of the region's edges are not the element's any more
}

// Returns the design over the piece's region. Its check points are particles of the piece, or cover
// the region if the particles' density is unknown.
ExpansionDesign MixtureComponent::DesignOn(const MixtureComponent& parent,
                                           const Piece& piece) const {
  const ExpansionDesign& before = parent.expansion_->design();
  const Vector middle = piece.particles.rows() > 0
                            ? Vector(piece.particles.colwise().mean().transpose())
                            : MiddleInside(problem_.prior(), piece.region);
  ExpansionDesign design =
      DesignForRegion(problem_, before.basis->truncation(), piece.region, middle);
  design.element = piece.element;
  if (piece.costs.size() == 0) {
    SpreadCheckPoints(problem_, middle, design);
    return design;
  }
  SetDrawnChecks(piece.particles, piece.costs, design);
  return design;
}

// Starts at the parent's row, over the region of one of the parent's pieces.
absl::Status MixtureComponent::ExpandOn(const MixtureComponent& parent, const Piece& piece,
                                        const Stop& stop) {
  taken_ = parent.taken_;
  schedule_ = parent.schedule_.OfPart(taken_);
  summary_ = parent.summary_;
  reexpansions_tried_ = parent.reexpansions_tried_;
  bisected_ = parent.bisected_ || parent.halves_;
  tempered_ = parent.tempered_;
  postponed_ = parent.postponed_;
  if (!parent.halves_) schedule_.StayWhole(taken_);
  particles_ = piece.particles;
  LearnedNoise noise = parent.expansion_->noise().ForNewExpansion();
  if (noise.posterior.centre.size() > 0 && particles_.rows() > problem_.dimension()) {
    noise.posterior = PosteriorOf(particles_);
  }
  POLYEST_ASSIGN_OR_RETURN(expansion_, Replay(problem_, DesignOn(parent, piece), std::move(noise),
                                              *store_, taken_, threads_, stop));
  ++reexpansions_;
  allowance_ = parent.allowance_;
  allowance_.Use(taken_, taken_);
  return absl::OkStatus();
}

// As ExpandOn, and moves the expansion to the piece's posterior.
absl::Status MixtureComponent::BeginOn(const MixtureComponent& parent, const Piece& piece,
                                       const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(ExpandOn(parent, piece, stop));
  bool moved = !parent.halves_;
  for (int i = 0; moved && !must_divide() && i < ReexpansionSchedule::kMaxAttemptsAtRow; ++i) {
    POLYEST_ASSIGN_OR_RETURN(moved, MoveToPosterior(stop, /*may_raise_order=*/true));
  }
  return absl::OkStatus();
}

}  // namespace polyest::internal
