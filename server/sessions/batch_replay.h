#pragma once

// Makes the rows that the batches of a session gave its estimator from these batches once more, as
// the journal keeps them: in the model's units, in time order, and without the rows left out.

#include <absl/status/statusor.h>

#include <optional>

#include "core/estimator/problem/resolved_problem.h"
#include "polyest/samples.h"
#include "polyest/v1/measurements.pb.h"
#include "server/sessions/row_reorder.h"
#include "server/sessions/run_cuts.h"

namespace polyest::internal {

class BatchReplay {
 public:
  // Begins at the session's first batch, or where `from` says. `reorder_window_s` is the session's,
  // as of BatchIntake; `cuts` are the rows left out. The problem and the cuts must outlive this.
  BatchReplay(const ResolvedProblem& problem, double reorder_window_s, const RunCuts& cuts,
              const RowReorder::Resumption& from = {});

  // Returns what the next batch gives the estimator; nothing, as of RowReorder::IsNothing, if all
  // of its rows are held back or left out. DATA_LOSS for a batch that could not have been taken.
  absl::StatusOr<Samples> Next(const v1::Measurements& batch);

 private:
  const ResolvedProblem& problem_;
  const RunCuts& cuts_;
  std::optional<RowReorder> reorder_;  // none: rows come in time order
};

}  // namespace polyest::internal
