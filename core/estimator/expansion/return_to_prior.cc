#include "core/estimator/expansion/return_to_prior.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/common/infeasible.h"
#include "core/common/status.h"
#include "core/estimator/expansion/likelihood_power.h"
#include "core/estimator/expansion/model_agreement.h"
#include "core/estimator/expansion/replay.h"
#include "core/estimator/problem/truncation.h"

namespace polyest::internal {
namespace {

// The shift at which no higher order is tried: the error grows quickly with the record.
constexpr double kGoodShift = 0.25 * kAccurateShift;
// An expansion over the prior is taken if it is accurate or if its shift is at most this part of
// the present one's.
constexpr double kClearlyBetter = 0.5;
// After a trial in vain the next one waits until the record has grown by this factor, or by kStay
// where the expansion is over the prior already.
constexpr double kGrowthInVain = 2;

double ShiftOf(const RegionalExpansion& expansion, const ResolvedProblem& problem) {
  return AgreementWithModel(expansion, expansion.MakeCost(problem.problem().regularization)).shift;
}

// Returns the design over the whole prior whose check points are the first particles.
absl::StatusOr<ExpansionDesign> DesignWithDraws(const ResolvedProblem& problem,
                                                const Truncation& truncation,
                                                const Matrix& particles, const Vector& costs) {
  POLYEST_ASSIGN_OR_RETURN(ExpansionDesign design, DesignForPrior(problem, truncation));
  SetDrawnChecks(particles, costs, design);
  return design;
}

}  // namespace

bool HasReturnedToPrior(const ResolvedProblem& problem, const ExpansionDesign& design) {
  const Truncation first = FirstTruncation(problem.problem().expansion, problem.dimension());
  return design.whole_prior && design.basis->order() > first.order;
}

bool MayReturnToPrior(const RegionalExpansion& present, const ReexpansionRequest& request) {
  const ResolvedProblem& problem = *request.problem;
  if (problem.dimension() <= kFewDimensions || problem.problem().expansion.order) return false;
  if (!request.may_raise_order || !request.may_replay) return false;
  if (!present.design().element.bounds().empty() || problem.ended_runs() != nullptr) return false;
  const PriorTried& memory = request.memory.prior;
  double growth = memory.in_vain ? kGrowthInVain : 0;
  if (HasReturnedToPrior(problem, present.design())) growth = kStay;
  const bool waits = static_cast<double>(request.rows) < growth * static_cast<double>(memory.tried);
  return !waits && ShiftOf(present, problem) > kAccurateShift;
}

absl::StatusOr<PriorReturn> ReturnToPrior(const RegionalExpansion& present,
                                          const ReexpansionRequest& request,
                                          const Matrix& particles, const Vector& costs,
                                          ReplayAllowance& allowance, const Stop& stop) {
  const ResolvedProblem& problem = *request.problem;
  const ExpansionOptions& options = problem.problem().expansion;
  const int n = problem.dimension();
  PriorReturn found;
  double best = std::max(kAccurateShift, kClearlyBetter * ShiftOf(present, problem));
  const bool again = HasReturnedToPrior(problem, present.design());
  std::optional<Truncation> next = again ? present.design().basis->truncation()
                                         : NextTruncation(options, n, FirstTruncation(options, n));
  for (; next && allowance.AllowsRecord(request.rows); next = NextTruncation(options, n, *next)) {
    auto design = DesignWithDraws(problem, *next, particles, costs);
    if (!design.ok()) break;
    auto replayed = Replay(problem, *std::move(design), present.noise().ForNewExpansion(),
                           *request.store, request.rows, request.threads, stop);
    allowance.Use(request.rows, request.rows);
    if (IsInfeasible(replayed.status())) break;
    if (!replayed.ok()) return replayed.status();
    const double shift = ShiftOf(**replayed, problem);
    if (shift <= best) {
      best = shift;
      std::swap(found.expansion, *replayed);
    }
    if (*replayed) found.propagated_rows += (*replayed)->propagated_rows();
    if (best <= kGoodShift) break;
  }
  return found;
}

}  // namespace polyest::internal
