#include "core/estimator/expansion/reexpansion.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "core/common/infeasible.h"
#include "core/common/status.h"
#include "core/estimator/expansion/expansion_mover.h"
#include "core/estimator/expansion/likelihood_power.h"
#include "core/estimator/expansion/model_agreement.h"
#include "core/estimator/expansion/overlooked_minima.h"
#include "core/estimator/expansion/reexpansion_particles.h"
#include "core/estimator/expansion/return_to_prior.h"
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

// Carries out one re-expansion; holds what changes between its attempts.
class Reexpander {
 public:
  Reexpander(const RegionalExpansion& present, const ReexpansionRequest& request, const Stop& stop)
      : present_(present), request_(request), stop_(stop), mover_(present, request, stop) {}

  absl::StatusOr<Reexpansion> Run() && {
    drawn_.xis = request_.guesses;
    memory_ = request_.memory;
    if (!WouldChangeNothing()) POLYEST_RETURN_IF_ERROR(Attempt());
    return Reexpansion{.moves = std::move(mover_).TakeMoves(),
                       .particles = std::move(drawn_.xis),
                       .memory = std::move(memory_),
                       .overlooked = overlooked_};
  }

 private:
  absl::Status Attempt() {
    if (StaysOnPrior()) {
      POLYEST_RETURN_IF_ERROR(Sample(/*attempt=*/0).status());
    } else {
      POLYEST_RETURN_IF_ERROR(FollowPosterior());
    }
    return mover_.has_moved() ? absl::OkStatus() : TryPrior();
  }

  absl::Status FollowPosterior() {
    bool may_move = true;
    for (int attempt = 0; attempt < kMaxAttempts; ++attempt) {
      POLYEST_ASSIGN_OR_RETURN(const bool sampled, Sample(attempt));
      if (!sampled) break;
      const std::vector<int> leaning = Leaning(design(), etas_);
      if (!leaning.empty()) {
        POLYEST_ASSIGN_OR_RETURN(const bool moved, Widen(leaning));
        if (!moved) break;
        has_widened_ = true;
        memory_.costs.resize(0);  // the particles end at the edge
        continue;
      }
      if (!may_move) break;
      if (Pays(RegionOfParticles(drawn_.xis))) {
        POLYEST_RETURN_IF_ERROR(AddOverlooked(attempt));
        if (overlooked_ && request_.ends_at_overlooked) break;
      }
      const Region region = RegionOfParticles(drawn_.xis);
      if (!Pays(region)) return mover_.has_moved() ? absl::OkStatus() : RaiseOrder();
      POLYEST_ASSIGN_OR_RETURN(const bool moved, Contract(region));
      if (!moved) break;
      may_move = power_ < 1;
    }
    return absl::OkStatus();
  }

  const RegionalExpansion& expansion() const { return mover_.expansion(); }
  const ExpansionDesign& design() const { return expansion().design(); }
  const ExpansionOptions& options() const { return request_.problem->problem().expansion; }
  Cost MakeCost() const { return expansion().MakeCost(request_.problem->problem().regularization); }

  Truncation OneOrderLess() const {
    Truncation truncation = FirstTruncation(options(), request_.problem->dimension());
    truncation.order = std::max(truncation.order, mover_.truncation().order - 1);
    return truncation;
  }

  std::optional<Truncation> NextOrder() const {
    return NextTruncation(options(), request_.problem->dimension(), mover_.truncation());
  }

  bool IsOnPrior() const {
    return !mover_.has_moved() && HasReturnedToPrior(*request_.problem, present_.design());
  }

  // Whether the expansion has returned to the prior not long ago.
  bool StaysOnPrior() const {
    return IsOnPrior() && static_cast<double>(request_.rows) <
                              kStay * static_cast<double>(request_.memory.prior.stays_from);
  }

  // Returns to the prior if this serves (return_to_prior.h).
  absl::Status TryPrior() {
    if (memory_.costs.size() == 0 || !MayReturnToPrior(present_, request_)) {
      return absl::OkStatus();
    }
    if (mover_.PostponedIfWithheld()) return absl::OkStatus();
    POLYEST_ASSIGN_OR_RETURN(
        PriorReturn found,
        ReturnToPrior(present_, request_, drawn_.xis, memory_.costs, mover_.allowance(), stop_));
    mover_.CountPropagated(found.propagated_rows);
    memory_.prior.tried = request_.rows;
    memory_.prior.in_vain = !found.expansion;
    if (!found.expansion) return absl::OkStatus();
    if (!IsOnPrior()) memory_.prior.stays_from = request_.rows;
    mover_.Adopt(std::move(found.expansion));
    return absl::OkStatus();
  }

  std::vector<int> Leaning(const ExpansionDesign& design, const Matrix& etas) const {
    return LeaningAxes(design, request_.problem->prior(),
                       WithinKnown(*request_.problem, design.element), etas);
  }

  // Whether the particles of the last re-expansion say that this one would leave all as it is. In
  // more dimensions, where elements are few, drawing them again is the surer search for pieces of
  // the posterior that they overlooked.
  bool WouldChangeNothing() const {
    if (request_.problem->dimension() > kFewDimensions) return false;
    if (MayRaiseOrder(TrustedRegion(design()))) return false;
    Cost cost = MakeCost();
    cost.set_power(LikelihoodPower(expansion(), cost));
    const Matrix etas = Reweighted(request_.guesses, request_.memory.costs, cost, design());
    return etas.rows() > 0 && Leaning(design(), etas).empty() &&
           !Pays(RegionOfParticles(design().region.ManyToGerm(etas)));
  }

  // Whether a higher order is allowed and may follow the model over the region.
  bool MayRaiseOrder(const Region& region) const {
    return request_.may_raise_order && NextOrder() &&
           !IsRaisingInVain(request_.memory.order, kMaxErrorOfRaised, region, request_.rows,
                            present_.noise());
  }

  // Raises the order to the first one that follows the model; the present order stays if none does.
  absl::Status RaiseOrder() {
    const Region region = TrustedRegion(design());
    if (!MayRaiseOrder(region) || mover_.PostponedIfWithheld()) return absl::OkStatus();
    OrderInVain tried;
    for (auto next = NextOrder(); next; next = NextOrder()) {
      POLYEST_ASSIGN_OR_RETURN(const bool raised, mover_.Move({region, *next, {}}, drawn_));
      if (!raised && mover_.PostponedIfWithheld()) return absl::OkStatus();
      const double error = raised ? ErrorOf(expansion()) : kMaxError;
      if (error <= kMaxErrorOfRaised) return absl::OkStatus();
      if (tried.order == 0 || error < tried.error) {
        tried = TriedInVain(next->order, error, region, request_.rows, present_.noise());
      }
      if (!raised) break;
    }
    memory_.order = std::move(tried);
    mover_.GoBack();
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

  // Draws particles on the expansion reached so far. Returns false when the sampler finds no
  // starting point.
  absl::StatusOr<bool> Sample(int attempt) {
    Cost cost = MakeCost();
    power_ = std::min(LikelihoodPower(expansion(), cost),
                      PowerOfFirstSamples(*request_.problem, request_.rows));
    cost.set_power(power_);
    absl::StatusOr<Particles> particles = SampleForReexpansion(
        cost, design(), drawn_.xis, request_.seed + static_cast<uint64_t>(attempt), stop_);
    if (IsInfeasible(particles.status())) return false;
    if (!particles.ok()) return particles.status();
    etas_ = std::move(particles->etas);
    drawn_ = {design().region.ManyToGerm(etas_), std::move(particles->costs)};
    memory_.costs = drawn_.costs;
    return true;
  }

  // Widens the region along the axes on whose edges particles lean. Where the record is propagated
  // again, the region becomes as wide as the expansion's error allows, so that the posterior does
  // not soon come to an edge once more: the error grows as the power p + 1 of the width.
  absl::StatusOr<bool> Widen(const std::vector<int>& leaning) {
    const auto widened = [&](double factor) {
      return WidenedRegion(design(), etas_, leaning, factor);
    };
    const double room = kWidenedShift / LargestShift(expansion(), /*power=*/1);
    const double factor = std::min(std::pow(room, 1.0 / (mover_.truncation().order + 1)), kWidest);
    MoveTarget target{widened(kWiden), mover_.truncation(), {}};
    // The record may have to be propagated once more, over the region that is less wide.
    if (factor > kWiden && mover_.allowance().Allows(request_.rows, 2 * request_.rows)) {
      target.wider = widened(factor);
    }
    return mover_.Move(target, drawn_);
  }

  // Returns whether a contraction to the region saves enough. A region that this re-expansion has
  // widened stays as it is if the expansion is as good as the model all over it.
  bool Pays(const Region& region) const {
    if (IsOnPrior() && LargestShift(expansion(), /*power=*/1) <= kAccurateShift) return false;
    if (has_widened_ && LargestShift(expansion(), /*power=*/1) <= kNegligibleShift) return false;
    return region.LogVolume() < std::log(kPays) + TrustedRegion(design()).LogVolume();
  }

  // Puts particles around minima that a contraction to the region of the particles would lose.
  absl::Status AddOverlooked(int attempt) {
    Cost cost = MakeCost();
    cost.set_power(power_);
    ReexpansionRequest request = request_;
    request.allowance = mover_.allowance();
    POLYEST_ASSIGN_OR_RETURN(const ConfirmedMinima found,
                             OverlookedMinima(expansion(), cost, drawn_.xis, request, stop_));
    mover_.CountPropagated(found.propagated_rows);
    if (found.propagated_rows > 0) mover_.allowance().Use(request_.rows, request_.rows);
    Eigen::Index row = drawn_.xis.rows();
    const auto each =
        static_cast<Eigen::Index>(std::ceil(kShareOfOverlooked * static_cast<double>(row)));
    for (Eigen::Index i = 0; i < found.points.rows() && row >= 2 * each; ++i) {
      row -= each;
      drawn_.xis.middleRows(row, each) =
          DrawsAround(cost, found.points.row(i).transpose(), each,
                      request_.seed + static_cast<uint64_t>(attempt) + static_cast<uint64_t>(i));
      memory_.costs.resize(0);  // the particles are no draws any more
      overlooked_ = found.error <= kMaxErrorAtMinima;
    }
    return absl::OkStatus();
  }

  // Moves the expansion to a smaller region. One that has returned to the prior keeps its order,
  // and stays if it would be less accurate there.
  absl::StatusOr<bool> Contract(const Region& region) {
    if (!IsOnPrior()) return mover_.Move({region, OneOrderLess(), {}}, drawn_);
    const double before = LargestShift(present_, /*power=*/1);
    POLYEST_ASSIGN_OR_RETURN(const bool moved,
                             mover_.Move({region, mover_.truncation(), {}}, drawn_));
    if (!moved || LargestShift(expansion(), /*power=*/1) <= before) return moved;
    memory_.prior.stays_from = request_.rows;
    mover_.GoBack();
    return false;
  }

  const RegionalExpansion& present_;
  const ReexpansionRequest& request_;
  const Stop& stop_;
  ExpansionMover mover_;
  DrawnPoints drawn_;  // the posterior's particles
  Matrix etas_;        // the same by local coordinates of the expansion they were drawn on
  ReexpansionMemory memory_;
  double power_ = 1;  // of the likelihood from which they were drawn
  bool has_widened_ = false;
  bool overlooked_ = false;  // Reexpansion::overlooked
};

}  // namespace

absl::StatusOr<Reexpansion> Reexpand(const RegionalExpansion& present,
                                     const ReexpansionRequest& request, const Stop& stop) {
  return Reexpander(present, request, stop).Run();
}

absl::StatusOr<Reexpansion> ContinueReexpansion(const RegionalExpansion& present, Reexpansion begun,
                                                ReexpansionRequest request, const Stop& stop) {
  request.guesses = std::move(begun.particles);
  request.memory = std::move(begun.memory);
  request.allowance = begun.moves.allowance;
  const RegionalExpansion& reached = begun.moves.expansion ? *begun.moves.expansion : present;
  POLYEST_ASSIGN_OR_RETURN(Reexpansion next, Reexpand(reached, request, stop));
  next.moves.reexpansions += begun.moves.reexpansions;
  next.moves.propagated_rows += begun.moves.propagated_rows;
  if (!begun.moves.expansion) return next;
  if (next.moves.expansion) {
    next.moves.propagated_rows += begun.moves.expansion->propagated_rows();
  } else {
    next.moves.expansion = std::move(begun.moves.expansion);
  }
  return next;
}

}  // namespace polyest::internal
