#pragma once

// What of a session is in memory only while it is used: its problem and its estimator.

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

// Batches come in from any thread; the estimator is for one thread at a time.
class LoadedSession {
 public:
  // INVALID_ARGUMENT or RESOURCE_EXHAUSTED as the problem deserves.
  static absl::StatusOr<std::unique_ptr<LoadedSession>> Make(v1::Problem problem,
                                                             const ModelLibrary& models,
                                                             const ProblemLimits& limits = {});
  // As it was after the batches that the journal keeps, from its latest snapshot on if that is of
  // use. DATA_LOSS when they do not lead to `place`.
  static absl::StatusOr<std::unique_ptr<LoadedSession>> Load(const SessionJournal& journal,
                                                             int64_t session,
                                                             const SessionPlace& place,
                                                             const ModelLibrary& models,
                                                             const Stop& stop);

  // From here on the journal is given the estimator's snapshots of this session, and rows that are
  // no longer in memory are read from it. The journal must outlive this.
  void Attach(SessionJournal& journal, int64_t session);
  // Rows of batches up to `sequence`, which the journal keeps, need not stay in memory.
  void Release(int64_t sequence) { store_->Release(sequence); }

  const v1::Problem& problem() const { return problem_; }
  // Where batches are taken: not yet by the estimator.
  BatchIntake& intake() { return intake_; }
  const BatchIntake& intake() const { return intake_; }

  // The following each of one thread at a time.

  // Seconds of measurements processed, over all runs.
  double measured_s() const { return measured_s_; }
  // The last batch that the estimator has.
  int64_t sequence() const { return sequence_; }
  // Brings the estimator up to batch `sequence`, or as far as the batches taken go.
  absl::Status ProcessUpTo(int64_t sequence, const Stop& stop);
  // From everything processed, and made only once for it.
  absl::StatusOr<SharedEstimate> CurrentEstimate(const Stop& stop);
  // Calls `work` with the estimator, to which everything taken is appended, and with the last batch
  // taken.
  using Work = std::function<absl::Status(Estimator& estimator, int64_t sequence)>;
  absl::Status WithEstimator(const Work& work);

 private:
  LoadedSession(v1::Problem problem, const ResolvedProblem& resolved);
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
