#pragma once

// Takes in the batches of a session. Each batch is checked at once, so that it can be acknowledged,
// and held until the estimator, which may be busy for a while, takes it.

#include <absl/status/status.h>

#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <string>

#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/sample_checks.h"
#include "polyest/samples.h"
#include "polyest/v1/measurements.pb.h"
#include "proto/wire/convert/problem_limits.h"
#include "server/journal/session_journal.h"
#include "server/sessions/row_reorder.h"

namespace polyest::internal {

// A batch that has been checked and waits for the estimator.
struct TakenBatch {
  Samples samples;        // what it gives the estimator; may be nothing if rows are held back
  SessionPlace place;     // of the session after this batch
  double measured_s = 0;  // seconds from the first row of a run to its end, over all runs
  int64_t held_from = 0;  // RowReorder::held_from after it; 0: rows come in time order
};

// Thread-safe.
class BatchIntake {
 public:
  // `reorder_window_s`: rows may be out of order within so much time; 0: they may not.
  explicit BatchIntake(ResolvedProblem problem, double reorder_window_s = 0);

  // Returns the problem without parameters for runs other than the first.
  const ResolvedProblem& problem() const { return problem_; }
  // Return the place of the session after the last batch taken, and the seconds of measurements up
  // to there: those between the rows of a run, over all runs.
  SessionPlace place() const;
  double measured_s() const;

  // Returns the number of rows that have not been handed on yet.
  int64_t waiting_rows() const;
  // Returns about how many bytes the rows take that are held back, to be put in order.
  int64_t held_bytes() const;

  // Records a batch elsewhere, too; gets the place of the session after it.
  using Record = std::function<absl::Status(const SessionPlace&)>;
  // Checks the next batch and takes all of it or nothing, also when memory is short; cheap. Refuses
  // a bad batch with INVALID_ARGUMENT, and one whose runs bring more parameters than the limits
  // allow with RESOURCE_EXHAUSTED. Calls `record`, if there is one, for a good batch, and takes the
  // batch if that succeeds. An estimator of the problem accepts every batch that is taken here.
  absl::Status Take(const v1::Measurements& batch, const ProblemLimits& limits = {},
                    const Record& record = {});

  // Returns the oldest batch that has not been handed on yet; null when there is none or its number
  // is above `sequence`. It stays as it is until it is removed.
  const TakenBatch* Oldest(int64_t sequence) const;
  // Removes the oldest batch, which must be there: it has been handed on.
  void RemoveOldest();

 private:
  absl::Status CheckRuns(int runs, const ProblemLimits& limits);
  int64_t CountValues(const Samples& samples) const;
  absl::StatusOr<RowReorder::Step> PutInOrder(const Samples& samples) const;
  TakenBatch Following(const Samples& samples) const;

  const ResolvedProblem problem_;
  std::set<std::string> measured_;

  mutable std::mutex mutex_;
  SampleChecks checks_;
  std::optional<RowReorder> reorder_;  // none: rows come in time order
  int runs_;                           // number of runs for which the problem is known to be valid
  SessionPlace place_;
  double measured_s_ = 0;
  std::deque<TakenBatch> waiting_;
};

}  // namespace polyest::internal
