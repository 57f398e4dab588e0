#include "core/estimator/expansion/reexpansion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "core/common/infeasible.h"
#include "core/common/status.h"
#include "core/estimator/expansion/carry_over.h"
#include "core/estimator/expansion/likelihood_power.h"
#include "core/estimator/expansion/model_agreement.h"
#include "core/estimator/expansion/overlooked_minima.h"
#include "core/estimator/expansion/return_to_prior.h"
#include "core/estimator/expansion/settlement_particles.h"
#include "core/estimator/problem/truncation.h"

namespace polyest::internal {
namespace {

constexpr int kMaxAttempts = 15;
constexpr double kPays = 0.5;  // volume ratio: a move that saves less is not made
// Maximum mean square of the expansion's error in units of the noise's. A higher order with a
// larger error does not follow the model, and its ripples would be mistaken for pieces of the
// posterior.
constexpr double kMaxErrorOfRaised = 0.05;
// The error of an order of which no expansion can be made.
constexpr double kMaxError = std::numeric_limits<double>::max();
// Fraction of the particles that stands for a minimum that the sampler overlooked: enough for a
// piece of the posterior to be found there.
constexpr double kShareOfOverlooked = 0.03;
// Up to such errors in the cost at its minima an expansion can tell the pieces around them apart.
constexpr double kMaxErrorAtMinima = 1;
// The factor by which a region is widened: the least and the most.
constexpr double kWiden = 1.5, kWidest = 4;
// The expansion over a widened region should have at most this LargestShift, which grows as rows
// are added.
constexpr double kWidenedShift = 0.1 * kNegligibleShift;

// Carries out one settlement; holds the state that changes between attempts.
class Settler {
 public:
  Settler(const RegionalExpansion& present, const SettlementRequest& request, const Stop& stop)
      : present_(present), request_(request), stop_(stop) {}

  absl::StatusOr<Settlement> Run() {
    result_.particles = request_.guesses;
    result_.memory = request_.memory;
    result_.allowance = request_.allowance;
    if (IsInVain()) return std::move(result_);
    if (StaysOnPrior()) {
      POLYEST_RETURN_IF_ERROR(Sample(/*attempt=*/0).status());
    } else {
      POLYEST_RETURN_IF_ERROR(FollowPosterior());
    }
    if (!result_.expansion) POLYEST_RETURN_IF_ERROR(TryPrior());
    return std::move(result_);
  }

 private:
  absl::Status FollowPosterior() {
    bool may_move = true;
    for (int attempt = 0; attempt < kMaxAttempts; ++attempt) {
      POLYEST_ASSIGN_OR_RETURN(const bool sampled, Sample(attempt));
      if (!sampled) break;
      const ExpansionDesign& design = expansion().design();
      const std::vector<int> leaning = Leaning(design, particles_.etas);
      if (!leaning.empty()) {
        POLYEST_ASSIGN_OR_RETURN(const bool moved, Widen(leaning));
        if (!moved) break;
        has_widened_ = true;
        result_.memory.costs.resize(0);  // the particles end at the edge
        continue;
      }
      if (!may_move) break;
      if (Pays(RegionOfParticles(result_.particles))) {
        POLYEST_RETURN_IF_ERROR(AddOverlooked(attempt));
        if (result_.overlooked && request_.ends_at_overlooked) break;
      }
      const Region region = RegionOfParticles(result_.particles);
      if (!Pays(region)) {
        if (!result_.expansion) POLYEST_RETURN_IF_ERROR(RaiseOrder(TrustedRegion(design)));
        break;
      }
      POLYEST_ASSIGN_OR_RETURN(const bool moved, Contract(region));
      if (!moved) break;
      may_move = power_ < 1;
    }
    return absl::OkStatus();
  }

  const RegionalExpansion& expansion() const {
    return result_.expansion ? *result_.expansion : present_;
  }

  const ExpansionOptions& options() const { return request_.problem->problem().expansion; }
  const Truncation& present() const { return expansion().design().basis->truncation(); }

  Truncation OneOrderLess() const {
    Truncation truncation = FirstTruncation(options(), request_.problem->dimension());
    truncation.order = std::max(truncation.order, present().order - 1);
    return truncation;
  }

  bool IsOnPrior() const {
    return !result_.expansion && HasReturnedToPrior(*request_.problem, present_.design());
  }

  // Whether the expansion has returned to the prior not long ago.
  bool StaysOnPrior() const {
    return IsOnPrior() && static_cast<double>(request_.rows) <
                              kStay * static_cast<double>(request_.memory.prior.stays_from);
  }

  // Returns to the prior if this serves (return_to_prior.h).
  absl::Status TryPrior() {
    if (result_.memory.costs.size() == 0 || !MayReturnToPrior(present_, request_)) {
      return absl::OkStatus();
    }
    result_.postponed = result_.postponed || Withheld();
    if (Withheld()) return absl::OkStatus();
    POLYEST_ASSIGN_OR_RETURN(PriorReturn found,
                             ReturnToPrior(present_, request_, result_.particles,
                                           result_.memory.costs, result_.allowance, stop_));
    result_.propagated_rows += found.propagated_rows;
    PriorTried& memory = result_.memory.prior;
    memory.tried = request_.rows;
    memory.in_vain = !found.expansion;
    if (!found.expansion) return absl::OkStatus();
    if (!IsOnPrior()) memory.stays_from = request_.rows;
    result_.expansion = std::move(found.expansion);
    ++result_.reexpansions;
    return absl::OkStatus();
  }

  std::vector<int> Leaning(const ExpansionDesign& design, const Matrix& etas) const {
    return LeaningAxes(design, request_.problem->prior(),
                       WithinKnown(*request_.problem, design.element), etas);
  }

  // Whether the particles of the last settlement say that this one would leave all as it is. In
  // more dimensions, where elements are few, drawing them again is the surer search for pieces of
  // the posterior that they overlooked.
  bool IsInVain() const {
    if (request_.problem->dimension() > kFewDimensions) return false;
    const ExpansionDesign& design = present_.design();
    if (MayRaiseOrder(TrustedRegion(design))) return false;
    Cost cost = present_.MakeCost(request_.problem->problem().regularization);
    cost.set_power(LikelihoodPower(present_, cost));
    const Matrix etas = Reweighted(request_.guesses, request_.memory.costs, cost, design);
    return etas.rows() > 0 && Leaning(design, etas).empty() &&
           !Pays(RegionOfParticles(design.region.ManyToGerm(etas)));
  }

  // Whether a higher order is allowed and may follow the model over the region.
  bool MayRaiseOrder(const Region& region) const {
    return request_.may_raise_order &&
           NextTruncation(options(), request_.problem->dimension(), present()) &&
           !IsRaisingInVain(request_.memory.order, kMaxErrorOfRaised, region, request_.rows,
                            present_.noise());
  }

  // Raises the order to the first one that follows the model; the present order stays if none does.
  absl::Status RaiseOrder(const Region& region) {
    if (!MayRaiseOrder(region)) return absl::OkStatus();
    result_.postponed = Withheld();
    if (Withheld()) return absl::OkStatus();
    OrderInVain tried;
    auto next = NextTruncation(options(), request_.problem->dimension(), present());
    for (; next; next = NextTruncation(options(), request_.problem->dimension(), *next)) {
      POLYEST_ASSIGN_OR_RETURN(const bool raised, Move(region, *next));
      if (!raised && Withheld()) {  // not for what it would have shown
        result_.postponed = true;
        return absl::OkStatus();
      }
      const double error = raised ? ErrorOf(*result_.expansion) : kMaxError;
      if (error <= kMaxErrorOfRaised) return absl::OkStatus();
      if (tried.order == 0 || error < tried.error) {
        tried = TriedInVain(next->order, error, region, request_.rows, present_.noise());
      }
      if (!raised) break;
    }
    result_.memory.order = std::move(tried);
    if (!result_.expansion) return absl::OkStatus();
    result_.propagated_rows += result_.expansion->propagated_rows();
    result_.expansion.reset();
    return absl::OkStatus();
  }

  // Returns the mean ρ/σ² of the absorbed samples, treating all of them as equal: D/(N − D) with D
  // = Σ ρ_k/R_k.
  static double ErrorOf(const RegionalExpansion& expansion) {
    double discount = 0, samples = 0;
    for (size_t c = 0; c < expansion.sums().size(); ++c) {
      discount += expansion.Discount(static_cast<int>(c));
      samples += expansion.sums()[c].Degrees();
    }
    return discount / std::max(samples - discount, std::numeric_limits<double>::min());
  }

  // Returns false when the sampler finds no starting point.
  absl::StatusOr<bool> Sample(int attempt) {
    Cost cost = expansion().MakeCost(request_.problem->problem().regularization);
    power_ = std::min(LikelihoodPower(expansion(), cost),
                      PowerOfFirstSamples(*request_.problem, request_.rows));
    cost.set_power(power_);
    absl::StatusOr<Particles> particles =
        SampleForSettlement(cost, expansion().design(), result_.particles,
                            request_.seed + static_cast<uint64_t>(attempt), stop_);
    if (IsInfeasible(particles.status())) return false;
    if (!particles.ok()) return particles.status();
    particles_ = *std::move(particles);
    result_.particles = expansion().design().region.ManyToGerm(particles_.etas);
    result_.memory.costs = particles_.costs;
    return true;
  }

  // Widens the region along the axes on whose edges particles lean. Where the record is propagated
  // again, the region becomes as wide as the expansion's error allows, so that the posterior does
  // not soon come to an edge once more: the error grows as the power p + 1 of the width.
  absl::StatusOr<bool> Widen(const std::vector<int>& leaning) {
    const auto widened = [&](double factor) {
      return WidenedRegion(expansion().design(), particles_.etas, leaning, factor);
    };
    const double room = kWidenedShift / LargestShift(expansion(), /*power=*/1);
    const double factor = std::min(std::pow(room, 1.0 / (present().order + 1)), kWidest);
    std::optional<Region> wider;
    // The record may have to be propagated once more, over the region that is less wide.
    if (factor > kWiden && result_.allowance.Allows(request_.rows, 2 * request_.rows)) {
      wider = widened(factor);
    }
    return Move(widened(kWiden), present(), wider);
  }

  // Returns whether a contraction to the region saves enough. A region that this settlement has
  // widened stays as it is if the expansion is as good as the model all over it.
  bool Pays(const Region& region) const {
    if (IsOnPrior() && LargestShift(expansion(), /*power=*/1) <= kAccurateShift) return false;
    if (has_widened_ && LargestShift(expansion(), /*power=*/1) <= kNegligibleShift) return false;
    return region.LogVolume() < std::log(kPays) + TrustedRegion(expansion().design()).LogVolume();
  }

  // Puts particles around minima that a contraction to the region of the particles would lose.
  absl::Status AddOverlooked(int attempt) {
    Cost cost = expansion().MakeCost(request_.problem->problem().regularization);
    cost.set_power(power_);
    POLYEST_ASSIGN_OR_RETURN(
        const ConfirmedMinima found,
        OverlookedMinima(expansion(), cost, result_.particles, RequestNow(), stop_));
    result_.propagated_rows += found.propagated_rows;
    if (found.propagated_rows > 0) result_.allowance.Use(request_.rows, request_.rows);
    const auto each = static_cast<Eigen::Index>(
        std::ceil(kShareOfOverlooked * static_cast<double>(result_.particles.rows())));
    Eigen::Index row = result_.particles.rows();
    for (Eigen::Index i = 0; i < found.points.rows() && row >= 2 * each; ++i) {
      row -= each;
      result_.particles.middleRows(row, each) =
          DrawsAround(cost, found.points.row(i).transpose(), each,
                      request_.seed + static_cast<uint64_t>(attempt) + static_cast<uint64_t>(i));
      result_.memory.costs.resize(0);  // the particles are no draws any more
      result_.overlooked = found.error <= kMaxErrorAtMinima;
    }
    return absl::OkStatus();
  }

  // Moves the expansion to a smaller region. One that has returned to the prior keeps its order,
  // and stays if it would be less accurate there.
  absl::StatusOr<bool> Contract(const Region& region) {
    if (!IsOnPrior()) return Move(region, OneOrderLess());
    const double before = LargestShift(present_, /*power=*/1);
    POLYEST_ASSIGN_OR_RETURN(const bool moved, Move(region, present()));
    if (!moved || LargestShift(expansion(), /*power=*/1) <= before) return moved;
    result_.memory.prior.stays_from = request_.rows;
    result_.propagated_rows += result_.expansion->propagated_rows();
    result_.expansion.reset();
    return false;
  }

  // Returns a design over the region whose check points are the first particles.
  ExpansionDesign DesignOn(Region region, const Truncation& truncation) const {
    const Vector inside = result_.particles.colwise().mean().transpose();
    ExpansionDesign design =
        DesignForRegion(*request_.problem, truncation, std::move(region), inside);
    design.element = present_.design().element;
    SetDrawnChecks(result_.particles, particles_.costs, design);
    return design;
  }

  // Whether the allowance forbids to propagate the record from its beginning.
  bool Withheld() const { return !result_.allowance.AllowsRecord(request_.rows); }

  SettlementRequest RequestNow() const {
    SettlementRequest request = request_;
    request.allowance = result_.allowance;
    return request;
  }

  // Moves the sums to the region without propagating the record, with no fewer terms.
  absl::StatusOr<std::unique_ptr<RegionalExpansion>> Carried(const Region& region,
                                                             const Truncation& truncation) {
    if (request_.rows <= RowsOfShortRecord(*request_.problem)) {
      return InfeasibleError("the record is short");
    }
    const int64_t cost = RowsToCarryOver(expansion(), request_.rows);
    if (!result_.allowance.Allows(request_.rows, cost)) {
      return InfeasibleError("too many rows would be propagated again");
    }
    const double max_shift = Withheld() ? kMaxShiftUnderLimit : kMaxCarriedShift;
    const Truncation& terms = truncation.order < present().order ? present() : truncation;
    auto carried = CarryOver(*request_.problem, expansion(), DesignOn(region, terms),
                             *request_.store, request_.rows, request_.threads, stop_, max_shift);
    result_.allowance.Use(request_.rows, cost);
    return carried;
  }

  // Propagates the record over the region.
  absl::StatusOr<std::unique_ptr<RegionalExpansion>> Replayed(const Region& region,
                                                              const Truncation& truncation) {
    auto replayed =
        Replay(*request_.problem, DesignOn(region, truncation), present_.noise().ForNewExpansion(),
               *request_.store, request_.rows, request_.threads, stop_);
    result_.allowance.Use(request_.rows, request_.rows);
    return replayed;
  }

  // Propagates the record over the wider region, or over `region` where more trajectories fail in
  // the wider one than in the present.
  absl::StatusOr<std::unique_ptr<RegionalExpansion>> ReplayedWide(const Region& wider,
                                                                  const Region& region,
                                                                  const Truncation& truncation) {
    auto replayed = Replayed(wider, truncation);
    if (replayed.ok()) {
      if ((*replayed)->failures().size() <= expansion().failures().size()) return replayed;
      result_.propagated_rows += (*replayed)->propagated_rows();
    } else if (!IsInfeasible(replayed.status())) {
      return replayed;
    }
    return Replayed(region, truncation);
  }

  // Moves the expansion to the region, or to the wider one, if there is one, where the record must
  // be propagated again. Returns false when no expansion can be built; the present one then stays.
  absl::StatusOr<bool> Move(const Region& region, const Truncation& truncation,
                            const std::optional<Region>& wider = std::nullopt) {
    absl::StatusOr<std::unique_ptr<RegionalExpansion>> moved = Carried(region, truncation);
    if (IsInfeasible(moved.status()) && request_.may_replay) {
      result_.postponed = Withheld();
      if (Withheld()) return false;
      moved = wider ? ReplayedWide(*wider, region, truncation) : Replayed(region, truncation);
    }
    if (IsInfeasible(moved.status())) return false;
    if (!moved.ok()) return moved.status();
    if (result_.expansion) result_.propagated_rows += result_.expansion->propagated_rows();
    result_.expansion = *std::move(moved);
    result_.postponed = false;
    ++result_.reexpansions;
    return true;
  }

  const RegionalExpansion& present_;
  const SettlementRequest& request_;
  const Stop& stop_;
  double power_ = 1;  // of the likelihood from which the particles were drawn
  bool has_widened_ = false;
  Particles particles_;
  Settlement result_;
};

}  // namespace

absl::StatusOr<Settlement> MakeSettlement(const RegionalExpansion& present,
                                          const SettlementRequest& request, const Stop& stop) {
  return Settler(present, request, stop).Run();
}

absl::StatusOr<Settlement> ContinueSettlement(const RegionalExpansion& present, Settlement begun,
                                              SettlementRequest request, const Stop& stop) {
  request.guesses = std::move(begun.particles);
  request.memory = std::move(begun.memory);
  request.allowance = begun.allowance;
  const RegionalExpansion& reached = begun.expansion ? *begun.expansion : present;
  POLYEST_ASSIGN_OR_RETURN(Settlement settlement, MakeSettlement(reached, request, stop));
  settlement.reexpansions += begun.reexpansions;
  settlement.propagated_rows += begun.propagated_rows;
  if (!begun.expansion) return settlement;
  if (settlement.expansion) {
    settlement.propagated_rows += begun.expansion->propagated_rows();
  } else {
    settlement.expansion = std::move(begun.expansion);
  }
  return settlement;
}

}  // namespace polyest::internal
