#pragma once

// Holds the part of a session that is in memory only while it is used: its problem and its
// estimator.

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "core/fmu/model_library.h"
#include "polyest/estimator.h"
#include "polyest/stop.h"
#include "polyest/v1/estimate.pb.h"
#include "polyest/v1/problem.pb.h"
#include "proto/wire/convert/problem_limits.h"
#include "server/journal/session_journal.h"
#include "server/sessions/batch_intake.h"
#include "server/sessions/journal_store.h"
#include "server/sessions/session_observer.h"

namespace polyest::internal {

// Any thread may give it batches; the estimator is for one thread at a time.
class LoadedSession {
 public:
  // Makes a session without batches, whose rows may arrive out of order within
  // `reorder_window_s`. INVALID_ARGUMENT for a bad problem, RESOURCE_EXHAUSTED for one beyond the
  // limits; other errors are those of Estimator::Make.
  static absl::StatusOr<std::unique_ptr<LoadedSession>> Make(v1::Problem problem,
                                                             const ModelLibrary& models,
                                                             const ProblemLimits& limits = {},
                                                             double reorder_window_s = 0);
  // Rebuilds a session from the batches that the journal keeps. The latest snapshot in the journal,
  // if it is usable, saves most of the numerics. DATA_LOSS when the batches do not lead to `place`.
  static absl::StatusOr<std::unique_ptr<LoadedSession>> Load(const SessionJournal& journal,
                                                             const SessionHead& head,
                                                             const SessionPlace& place,
                                                             const ModelLibrary& models,
                                                             const Stop& stop);

  // From here on, gives the estimator's snapshots to the journal, as those of this session, and
  // reads rows that are no longer in memory from it. The journal must outlive this.
  void Attach(SessionJournal& journal, int64_t session);
  // Lets go of the rows of batches up to `sequence`, which the journal must keep.
  void Release(int64_t sequence) { store_->Release(sequence); }

  const v1::Problem& problem() const { return problem_; }
  // Returns the intake, which takes batches before the estimator gets them.
  BatchIntake& intake() { return intake_; }
  const BatchIntake& intake() const { return intake_; }

  // The following are for one thread at a time.

  // Returns the seconds of measurements that the estimator has, over all runs.
  double measured_s() const { return measured_s_; }
  // Returns the number of the last batch that the estimator has.
  int64_t sequence() const { return sequence_; }
  // Gives the estimator the batches up to `sequence`, or as many as have been taken, and processes
  // them.
  absl::Status ProcessUpTo(int64_t sequence, const Stop& stop);
  // Returns the estimate from everything processed. Computes it only once for the same last batch.
  absl::StatusOr<SharedEstimate> CurrentEstimate(const Stop& stop);
  // Gives the estimator every batch taken, without processing it, and calls `work` with the
  // estimator and the number of the last batch. Returns what `work` returns.
  using Work = std::function<absl::Status(Estimator& estimator, int64_t sequence)>;
  absl::Status WithEstimator(const Work& work);

 private:
  LoadedSession(v1::Problem problem, const ResolvedProblem& resolved, double reorder_window_s);
  void Restore(const SessionJournal& journal, int64_t session);
  absl::Status GiveUpTo(int64_t sequence);

  const v1::Problem problem_;
  BatchIntake intake_;
  const std::shared_ptr<JournalStore> store_;  // the estimator's; refers to the intake's problem
  std::unique_ptr<Estimator> estimator_;
  std::function<void(EstimatorSnapshot)> save_;
  int64_t sequence_ = 0;
  double measured_s_ = 0;
  SharedEstimate latest_;
};

}  // namespace polyest::internal
