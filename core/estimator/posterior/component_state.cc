#include "core/estimator/posterior/component_state.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "core/common/check.h"
#include "core/common/finite_matrix.h"
#include "core/common/status.h"
#include "core/estimator/posterior/mixture_component.h"

namespace polyest::internal {
namespace {

bool IsSummaryFor(const ResolvedProblem& problem, const RecordSummary& summary, int64_t rows) {
  const auto m = static_cast<size_t>(problem.channels());
  const size_t width = m + problem.streamed_inputs().size();
  const RowBlock& beginning = summary.beginning();
  return summary.rows() == rows && summary.channels().size() == m &&
         summary.facts().IsFor(width, width - m) &&
         beginning.rows.size() <= RecordSummary::kBeginning &&
         beginning.values.size() == beginning.rows.size() * width &&
         beginning.noise.size() == beginning.rows.size() * m;
}

bool IsMemoryFor(const ResolvedProblem& problem, const ReexpansionMemory& memory,
                 const Matrix& particles, int64_t rows) {
  const PriorTried& prior = memory.prior;
  if (std::min(prior.stays_from, prior.tried) < 0) return false;
  if (std::max(prior.stays_from, prior.tried) > rows) return false;
  if (memory.costs.size() > 0 &&
      (memory.costs.size() != particles.rows() || !memory.costs.allFinite())) {
    return false;
  }
  const OrderInVain& tried = memory.order;
  const auto n = static_cast<Eigen::Index>(problem.dimension());
  return tried.order == 0 || (tried.order > 0 && tried.rows >= 0 && std::isfinite(tried.error) &&
                              IsFiniteMatrix(tried.centre, n) && IsFiniteMatrix(tried.axes, n, n) &&
                              tried.noise_variance.size() == problem.channels() &&
                              (tried.noise_variance.array() > 0).all());
}

bool IsStateFor(const ResolvedProblem& problem, const ComponentState& state) {
  return state.taken > 0 && problem.first_row() <= state.taken &&
         ReexpansionSchedule::IsState(state.schedule, state.taken) &&
         state.expansion.absorbed.rows == state.taken &&
         state.particles.cols() == problem.dimension() && state.particles.allFinite() &&
         IsMemoryFor(problem, state.memory, state.particles, state.taken) && state.weight >= 0 &&
         state.weight <= 1 && state.room >= 1 &&
         IsSummaryFor(problem, state.summary, state.taken) &&
         ReplayAllowance::IsState(state.allowance, state.taken);
}

// Whether the rows at which the summary says that the record begins are those of the store.
absl::StatusOr<bool> BeginsAs(const RecordSummary& summary, const SampleStore& store) {
  const std::vector<SampleRow>& rows = summary.beginning().rows;
  const auto count = std::ssize(rows);
  if (count == 0) return true;
  if (count > store.rows()) return false;
  RowBlock block;
  POLYEST_RETURN_IF_ERROR(store.Read(0, count, block));
  return std::ranges::equal(rows, block.rows, [](const SampleRow& a, const SampleRow& b) {
    return a.run == b.run && a.time_s == b.time_s;
  });
}

// Whether the ended runs have the windows that they must have.
bool HasWindowsOf(const EndedRuns& ended, const ResolvedProblem& problem) {
  if (problem.population()) return ended.windows.count() == 0;
  return ended.windows.Suits(SumsWithRemainder(problem.problem().measured, ended),
                             std::ssize(ended.run));
}

// Gives the problem what a snapshot says of ended runs.
absl::Status SetEndedRuns(const std::optional<EndedRuns>& ended, ResolvedProblem& problem) {
  const bool has_ended = problem.runs() > problem.max_joint_runs();
  const auto shared = static_cast<int>(problem.SharedParameters().size());
  if (has_ended != ended.has_value() ||
      (ended && !IsWellFormed(*ended, shared, problem.dimension() - shared, problem.channels())) ||
      (ended && ended->shapes.empty() == problem.population().has_value()) ||
      (ended && !HasWindowsOf(*ended, problem))) {
    return absl::DataLossError("the snapshot's ended runs cannot be of this problem");
  }
  problem.set_ended_runs(ended ? std::make_shared<const EndedRuns>(*ended) : nullptr);
  return absl::OkStatus();
}

absl::StatusOr<ResolvedProblem> ProblemOf(const ResolvedProblem& problem,
                                          const ComponentState& state) {
  if (state.runs < 1 || (state.runs > 1 && !problem.per_run()) || state.runs > problem.max_runs()) {
    return absl::DataLossError(
        absl::StrCat("the snapshot's ", state.runs, " runs cannot be of this problem"));
  }
  ResolvedProblem own = problem;
  if (state.runs != problem.runs()) {
    POLYEST_ASSIGN_OR_RETURN(own, problem.AtRun(state.runs - 1));
  }
  POLYEST_RETURN_IF_ERROR(SetEndedRuns(state.ended_runs, own));
  IntegrationOptions integration = own.problem().integration;
  integration.relative_tolerance = state.relative_tolerance;
  if (!integration.Validate().ok()) {
    return absl::DataLossError("the snapshot's tolerance is out of range");
  }
  own.set_relative_tolerance(state.relative_tolerance);
  return own;
}

}  // namespace

ComponentState MixtureComponent::State() const {
  POLYEST_CHECK(!broken_ && !must_divide());
  ComponentState state;
  state.runs = problem_.runs();
  if (problem_.ended_runs() != nullptr) state.ended_runs = *problem_.ended_runs();
  state.relative_tolerance = problem_.problem().integration.relative_tolerance;
  state.expansion = expansion_->State();
  state.particles = particles_;
  state.memory = memory_;
  state.weight = weight_;
  state.room = room_;
  state.bisected = bisected_;
  state.taken = taken_;
  state.schedule = schedule_.state();
  state.reexpansions_tried = reexpansions_tried_;
  state.reexpansions = reexpansions_;
  state.abandoned_rows = abandoned_rows_;
  state.allowance = allowance_.state();
  state.postponed = postponed_;
  state.summary = summary_;
  return state;
}

absl::StatusOr<std::unique_ptr<MixtureComponent>> MixtureComponent::FromState(
    const ResolvedProblem& problem, ComponentState state, const SampleStore* store, int threads,
    const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const ResolvedProblem own, ProblemOf(problem, state));
  if (!IsStateFor(own, state)) {
    return absl::DataLossError("the snapshot's windows or particles cannot be of this problem");
  }
  POLYEST_ASSIGN_OR_RETURN(const bool same_rows, BeginsAs(state.summary, *store));
  if (!same_rows) {
    return absl::FailedPreconditionError("the rows appended are not those of the snapshot");
  }
  std::unique_ptr<MixtureComponent> component(new MixtureComponent(own, store, threads));
  POLYEST_ASSIGN_OR_RETURN(
      component->expansion_,
      RegionalExpansion::FromState(component->problem_, std::move(state.expansion), *store, threads,
                                   stop));
  component->particles_ = std::move(state.particles);
  component->memory_ = std::move(state.memory);
  component->weight_ = state.weight;
  component->room_ = state.room;
  component->bisected_ = state.bisected;
  component->taken_ = state.taken;
  component->schedule_.Restore(state.schedule);
  component->reexpansions_tried_ = state.reexpansions_tried;
  component->reexpansions_ = state.reexpansions;
  component->abandoned_rows_ = state.abandoned_rows;
  component->allowance_.Restore(state.allowance);
  component->postponed_ = state.postponed;
  component->summary_ = std::move(state.summary);
  return component;
}

}  // namespace polyest::internal
