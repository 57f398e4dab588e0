#include "core/estimator/expansion/expansion_mover.h"

#include <utility>

#include "core/common/infeasible.h"
#include "core/estimator/expansion/carry_over.h"
#include "core/estimator/expansion/replay.h"

namespace polyest::internal {

ExpansionMover::ExpansionMover(const RegionalExpansion& present, const ReexpansionRequest& request,
                               const Stop& stop)
    : present_(present), request_(request), stop_(stop) {
  moves_.allowance = request.allowance;
}

absl::StatusOr<bool> ExpansionMover::Move(const MoveTarget& target, const DrawnPoints& drawn) {
  MadeExpansion moved = Carried(target, drawn);
  if (IsInfeasible(moved.status()) && request_.may_replay) {
    moves_.postponed = Withheld();
    if (moves_.postponed) return false;
    moved = ReplayedWhereFewFail(target, drawn);
  }
  if (IsInfeasible(moved.status())) return false;
  if (!moved.ok()) return moved.status();
  Adopt(*std::move(moved));
  moves_.postponed = false;
  return true;
}

void ExpansionMover::Adopt(std::unique_ptr<RegionalExpansion> expansion) {
  GoBack();
  moves_.expansion = std::move(expansion);
  ++moves_.reexpansions;
}

void ExpansionMover::GoBack() {
  if (!moves_.expansion) return;
  CountPropagated(moves_.expansion->propagated_rows());
  moves_.expansion.reset();
}

bool ExpansionMover::PostponedIfWithheld() {
  if (Withheld()) moves_.postponed = true;
  return Withheld();
}

// Returns a design over the region whose check points are the first particles.
ExpansionDesign ExpansionMover::DesignOn(Region region, const Truncation& truncation,
                                         const DrawnPoints& drawn) const {
  const Vector inside = drawn.xis.colwise().mean().transpose();
  ExpansionDesign design =
      DesignForRegion(*request_.problem, truncation, std::move(region), inside);
  design.element = present_.design().element;
  SetDrawnChecks(drawn.xis, drawn.costs, design);
  return design;
}

// Carries the sums over to the region, with no fewer terms.
ExpansionMover::MadeExpansion ExpansionMover::Carried(const MoveTarget& target,
                                                      const DrawnPoints& drawn) {
  if (request_.rows <= RowsOfShortRecord(*request_.problem)) {
    return InfeasibleError("the record is short");
  }
  const int64_t cost = RowsToCarryOver(expansion(), request_.rows);
  if (!moves_.allowance.Allows(request_.rows, cost)) {
    return InfeasibleError("too many rows would be propagated again");
  }
  const double max_shift = Withheld() ? kMaxShiftUnderLimit : kMaxCarriedShift;
  const Truncation& terms =
      target.truncation.order < truncation().order ? truncation() : target.truncation;
  auto carried = CarryOver(*request_.problem, expansion(), DesignOn(target.region, terms, drawn),
                           *request_.store, request_.rows, request_.threads, stop_, max_shift);
  moves_.allowance.Use(request_.rows, cost);
  return carried;
}

// Propagates the record over the region.
ExpansionMover::MadeExpansion ExpansionMover::Replayed(const Region& region,
                                                       const Truncation& truncation,
                                                       const DrawnPoints& drawn) {
  auto replayed = Replay(*request_.problem, DesignOn(region, truncation, drawn),
                         present_.noise().ForNewExpansion(), *request_.store, request_.rows,
                         request_.threads, stop_);
  moves_.allowance.Use(request_.rows, request_.rows);
  return replayed;
}

// Propagates the record over the wider region if there is one, and over the other one if there is
// none or if more trajectories fail in it than in the present region.
ExpansionMover::MadeExpansion ExpansionMover::ReplayedWhereFewFail(const MoveTarget& target,
                                                                   const DrawnPoints& drawn) {
  if (target.wider) {
    auto replayed = Replayed(*target.wider, target.truncation, drawn);
    if (replayed.ok()) {
      if ((*replayed)->failures().size() <= expansion().failures().size()) return replayed;
      CountPropagated((*replayed)->propagated_rows());
    } else if (!IsInfeasible(replayed.status())) {
      return replayed;
    }
  }
  return Replayed(target.region, target.truncation, drawn);
}

}  // namespace polyest::internal
