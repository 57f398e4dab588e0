// The state that an expansion keeps on its way along the record (regional_expansion.h), so that it
// can be made again, or another one in its place, without its first rows.

#include <algorithm>
#include <memory>
#include <utility>

#include "core/estimator/expansion/expansion_state.h"
#include "core/estimator/expansion/regional_expansion.h"

namespace polyest::internal {
namespace {

// Returns whether a state is kept before `row`, which begins a run or is one of the run that began
// with the row `run_begin`. The last state was kept before the row `kept`.
bool IsDue(const ResolvedProblem& problem, int64_t row, bool begins_run, int64_t run_begin,
           int64_t kept) {
  const int64_t interval = problem.problem().integration.samples_between_checkpoints;
  if (begins_run) return row - kept >= interval;
  return problem.has_checkpoints_in_runs() && (row - run_begin) % interval == 0;
}

// Returns the number of rows after which a state was kept.
int64_t KeptRows(const std::shared_ptr<const ExpansionState>& state) {
  return state ? state->absorbed.rows : 0;
}

}  // namespace

int RegionalExpansion::RowsToKeptState(const RowBlock& block) const {
  int64_t kept = KeptRows(kept_state_), begin = trajectories_.run_begin();
  int run = trajectories_.run();
  for (int k = 0; k < block.count(); ++k) {
    const int64_t row = trajectories_.next_row() + k;
    const bool begins = block.rows[static_cast<size_t>(k)].run != run;
    const bool due = IsDue(problem_, row, begins, begin, kept);
    if (due && k > 0) return k;
    if (due) kept = row;
    if (!begins) continue;
    begin = row;
    run = block.rows[static_cast<size_t>(k)].run;
  }
  return block.count();
}

// Keeps the present state if it is one that can be gone on from. `next_run` is the run of the next
// row.
void RegionalExpansion::KeepState(int next_run) {
  const int64_t rows = trajectories_.next_row();
  if (absorbed_.rows != rows || rows == problem_.first_row()) return;
  const bool begins = next_run != trajectories_.run();
  const int64_t kept = KeptRows(kept_state_);
  if (!IsDue(problem_, rows, begins, trajectories_.run_begin(), kept) || kept == rows) return;
  ExpansionState state = State();
  if (begins) {
    state.trajectories.ensemble.reset();
    state.trajectories.controls.reset();
  } else if (!state.trajectories.ensemble) {
    return;
  }
  kept_state_ = std::make_shared<const ExpansionState>(std::move(state));
}

}  // namespace polyest::internal
