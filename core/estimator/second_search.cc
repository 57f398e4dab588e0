#include "core/estimator/second_search.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/common/infeasible.h"
#include "core/common/status.h"
#include "core/estimator/expansion/expansion_design.h"
#include "core/estimator/expansion/likelihood_power.h"
#include "core/estimator/memory_use.h"

namespace polyest::internal {
namespace {

constexpr double kMinMisfit = 3;
constexpr double kGrowthToRepeat = 4;
// Ratio of the misfits from which on the second mixture is the better one.
constexpr double kBetter = 0.8;
// Where the rows that are propagated again are limited, a search may take this part of them.
constexpr int64_t kSearchesInLimit = 10;

}  // namespace

absl::Status SecondSearch::CheckState(const State& state, int64_t rows) {
  if (state.row > rows && state.row <= std::max(kFirstRow, NextWindow(rows)) &&
      state.tried_row >= 0 && state.tried_row <= rows && state.tried_misfit >= 0) {
    return absl::OkStatus();
  }
  return absl::DataLossError("the snapshot's looks for a better minimum cannot be of its rows");
}

int64_t SecondSearch::memory_bytes() const { return second_ ? BytesOf(*second_) : 0; }

bool SecondSearch::IsDue(const Problem& problem, double misfit) const {
  if (!problem.expansion.adaptive || misfit < kMinMisfit) return false;
  const std::optional<int64_t>& limit = problem.expansion.max_replay_row_count;
  if (limit && state_.row > *limit / kSearchesInLimit) return false;
  return static_cast<double>(state_.row) >=
             kGrowthToRepeat * static_cast<double>(state_.tried_row) ||
         misfit >= kGrowthToRepeat * state_.tried_misfit;
}

absl::Status SecondSearch::Look(const ResolvedProblem& problem, const SampleStore* store,
                                int threads, const Stop& stop,
                                std::unique_ptr<ComponentMixture>& mixture) {
  if (second_ || IsDue(problem.problem(), mixture->Misfit())) {
    POLYEST_ASSIGN_OR_RETURN(bool better, Search(problem, store, threads, stop, mixture));
    const bool few = problem.dimension() <= kFewDimensions && !BeginsInTails(problem);
    if (!better && !in_tails_ && few) {
      in_tails_ = true;
      POLYEST_ASSIGN_OR_RETURN(better, Search(problem, store, threads, stop, mixture));
    }
    in_tails_ = false;
    state_.tried_row = state_.row;
    state_.tried_misfit = mixture->Misfit();
  }
  state_.row = NextWindow(state_.row);
  return absl::OkStatus();
}

absl::StatusOr<bool> SecondSearch::Search(const ResolvedProblem& problem, const SampleStore* store,
                                          int threads, const Stop& stop,
                                          std::unique_ptr<ComponentMixture>& mixture) {
  const double misfit = mixture->Misfit();
  if (!second_) {
    std::optional<ResolvedProblem> first_run;
    if (problem.runs() > 1) {
      POLYEST_ASSIGN_OR_RETURN(first_run, problem.WithRuns(1));
    }
    auto begun = ComponentMixture::OfPrior(
        first_run ? *first_run : problem, store, threads,
        {.misfit = misfit, .rows = state_.row, .in_tails = in_tails_}, stop);
    // The mixture that there is goes on where no other can begin.
    if (IsInfeasible(begun.status())) return false;
    POLYEST_ASSIGN_OR_RETURN(second_, std::move(begun));
  }
  const absl::Status taken = second_->TakeUpTo(state_.row, stop);
  if (!taken.ok() && !IsInfeasible(taken)) return taken;
  const bool better = taken.ok() && second_->Misfit() < kBetter * misfit;
  if (better) std::swap(mixture, second_);
  mixture->AddWorkOf(*second_);
  second_.reset();
  return better;
}

}  // namespace polyest::internal
