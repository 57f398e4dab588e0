// What a mixture component does when a run begins that its expansion has no room for: all earlier
// runs lose their own parameters (problem/ended_runs.h), and the expansion goes on over the shared
// ones and those of the new run.
//
// From then on each run is eliminated at its end, and all of them again where that does not hold
// any more (expansion/ended_runs_renewal.h): at the end of a run, and after a revision of the
// noise, because another scale is learned from what the ended runs say with the present one. All of
// it is a function of the rows alone.

#include <memory>
#include <optional>
#include <utility>

#include "core/common/infeasible.h"
#include "core/common/status.h"
#include "core/estimator/expansion/ended_runs_renewal.h"
#include "core/estimator/expansion/germ_summary.h"
#include "core/estimator/expansion/new_runs.h"
#include "core/estimator/expansion/reexpansion.h"
#include "core/estimator/posterior/mixture_component.h"

namespace polyest::internal {
namespace {

constexpr int kDrawsToBegin = 500;

}  // namespace

// Returns particles of the present posterior, germ coordinates. Leaves the component as it is, so
// that a stop has no effect on later results.
absl::StatusOr<Matrix> MixtureComponent::ParticlesNow(const Stop& stop) const {
  ReexpansionRequest request = RequestReexpansion();
  request.may_raise_order = false;
  request.memory = {};  // the particles are drawn anew
  request.allowance = ReplayAllowance();
  POLYEST_ASSIGN_OR_RETURN(Reexpansion found, Reexpand(*expansion_, request, stop));
  if (found.particles.rows() <= problem_.dimension()) {
    return InfeasibleError("the posterior of a run that has ended was not found");
  }
  return std::move(found.particles);
}

absl::Status MixtureComponent::BeginAwaitedRun(const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(BeginRunAlone(*awaited_run_, stop));
  awaited_run_.reset();
  particles_for_run_.reset();
  return absl::OkStatus();
}

absl::Status MixtureComponent::BeginRunAlone(int run, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(ResolvedProblem next, problem_.OfRun(run));
  std::optional<Matrix> particles = particles_for_run_;
  std::optional<GermSummary> posterior;
  if (!particles) {
    posterior = GaussianPosterior(problem_, *expansion_, stop);
    POLYEST_RETURN_IF_ERROR(stop.Check());
    if (!posterior) {
      POLYEST_ASSIGN_OR_RETURN(particles, ParticlesNow(stop));
    }
  }
  if (!posterior) posterior = SummaryOf(*particles);
  const EndedRuns* before = problem_.ended_runs();
  const bool holds = before != nullptr && HoldsAbout(*before, SharedPart(problem_, *posterior)) &&
                     HoldsWith(*before, expansion_->noise());
  auto ended = holds ? std::make_shared<EndedRuns>(*before) : std::make_shared<EndedRuns>();
  const EliminationRequest request{&problem_, store_, threads_, expansion_->noise()};
  int64_t work = 0;
  if (holds) {
    POLYEST_ASSIGN_OR_RETURN(work, EliminateLast(request, *posterior, taken_, stop, *ended));
  } else {
    if (!particles) {
      POLYEST_ASSIGN_OR_RETURN(particles, ParticlesNow(stop));
      posterior = SummaryOf(*particles);
    }
    POLYEST_ASSIGN_OR_RETURN(work, EliminateAll(request, *particles, taken_, stop, *ended));
  }
  next.set_ended_runs(std::move(ended));
  POLYEST_RETURN_IF_ERROR(GoOnWith(std::move(next), SharedPart(problem_, *posterior), stop));
  abandoned_rows_ += work;
  if (!holds) {
    ++reexpansions_tried_;
    ++reexpansions_;
  }
  return absl::OkStatus();
}

// Eliminates the ended runs again if they were eliminated with another noise. A stop changes
// nothing.
absl::Status MixtureComponent::RenewEndedRuns(const Stop& stop) {
  const EndedRuns* before = problem_.ended_runs();
  if (before == nullptr || HoldsWith(*before, expansion_->noise()) || IsReplayWithheld()) {
    return absl::OkStatus();
  }
  POLYEST_ASSIGN_OR_RETURN(Matrix particles, ParticlesNow(stop));
  auto ended = std::make_shared<EndedRuns>();
  const EliminationRequest request{&problem_, store_, threads_, expansion_->noise()};
  POLYEST_ASSIGN_OR_RETURN(const int64_t work,
                           EliminateAll(request, particles, before->rows, stop, *ended));
  ResolvedProblem renewed = problem_;
  renewed.set_ended_runs(std::move(ended));
  POLYEST_RETURN_IF_ERROR(ReplayAs(std::move(renewed), expansion_->design(),
                                   expansion_->noise().ForNewExpansion(), std::move(particles),
                                   stop));
  abandoned_rows_ += work;
  ++reexpansions_tried_;
  ++reexpansions_;
  return absl::OkStatus();
}

// Goes on with a problem whose run has no rows yet; `shared` is the posterior of the shared germs.
absl::Status MixtureComponent::GoOnWith(ResolvedProblem next, const GermSummary& shared,
                                        const Stop& stop) {
  const Matrix factor = FactorOf(shared.covariance);
  LearnedNoise noise = expansion_->noise().ForNewExpansion();
  if (noise.posterior.centre.size() > 0) {
    noise.posterior = SummaryAfterEndedRuns(next, shared.mean, factor);
  }
  noise.centre.resize(0);
  ExpansionDesign design =
      DesignAfterEndedRuns(next, shared.mean, factor, expansion_->design().element);
  Matrix draws = DrawsForNewRun(next, shared.mean, factor, kDrawsToBegin).etas;
  POLYEST_RETURN_IF_ERROR(
      ReplayAs(std::move(next), std::move(design), std::move(noise), std::move(draws), stop));
  schedule_.CountAnewFrom(taken_);
  bisected_ = bisected_ && !element().bounds().empty();
  return absl::OkStatus();
}

}  // namespace polyest::internal
