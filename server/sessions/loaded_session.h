#pragma once

// Holds the part of a session that is in memory only while it is used: its problem and its
// estimator.

#include <absl/status/statusor.h>

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>

#include "core/external/model_library.h"
#include "polyest/estimator.h"
#include "polyest/stop.h"
#include "polyest/v1/estimate.pb.h"
#include "polyest/v1/problem.pb.h"
#include "proto/wire/convert/problem_limits.h"
#include "server/journal/session_journal.h"
#include "server/sessions/batch_intake.h"
#include "server/sessions/journal_store.h"
#include "server/sessions/run_cuts.h"
#include "server/sessions/session_observer.h"

namespace polyest::internal {

// Any thread may give it batches; the estimator is for one thread at a time.
class LoadedSession {
 public:
  // Checks whether there is memory for about so many bytes.
  using CheckMemory = std::function<absl::Status(int64_t bytes)>;

  struct Options {
    const ModelLibrary& models;
    ProblemLimits limits = {};
    CheckMemory check_memory = {};  // empty: memory is not checked
    int threads = 1;                // EstimatorOptions::threads, ≥ 1; one for models in processes
  };

  // Makes a session without batches, whose rows may arrive out of order within
  // `reorder_window_s`. INVALID_ARGUMENT for a bad problem, RESOURCE_EXHAUSTED for one beyond the
  // limits; other errors are those of `check_memory` and of Estimator::Make, which may take
  // seconds.
  static absl::StatusOr<std::unique_ptr<LoadedSession>> Make(v1::Problem problem,
                                                             double reorder_window_s,
                                                             const Options& options,
                                                             const Stop& stop = {});
  // Rebuilds a session from the batches that the journal keeps. The latest snapshot in the journal,
  // if it is usable, saves most of the numerics. DATA_LOSS when the batches do not lead to `place`;
  // the errors of `check_memory`.
  static absl::StatusOr<std::unique_ptr<LoadedSession>> Load(const SessionJournal& journal,
                                                             const SessionHead& head,
                                                             const SessionPlace& place,
                                                             const Options& options,
                                                             const Stop& stop);

  // Counts a snapshot of so many bytes as stored, in place of the last one, if it may be; returns
  // whether it may.
  using TakeSnapshotStorage = std::function<bool(int64_t bytes)>;

  // From here on, gives the estimator's snapshots to the journal, as those of this session, as far
  // as there is room for them, and reads rows that are no longer in memory from it. The journal
  // must outlive this.
  void Attach(SessionJournal& journal, int64_t session, TakeSnapshotStorage take_storage);
  // Lets go of the rows of batches up to `sequence`, which the journal must keep.
  void Release(int64_t sequence) { computed_.store->Release(sequence); }

  const v1::Problem& problem() const { return problem_; }
  // Returns the intake, which takes batches before the estimator gets them.
  BatchIntake& intake() { return intake_; }
  const BatchIntake& intake() const { return intake_; }

  // The following are for one thread at a time.

  // Whether an exception, such as a lack of memory, has ended one of the calls below, so that what
  // is computed may be half done. None of them may be called again until Renew has computed it anew
  // from the batches, all of which the journal must keep. Renew waits for the disk.
  bool in_doubt() const { return in_doubt_; }
  absl::Status Renew(const Stop& stop);
  // Returns the seconds of measurements that the estimator has, over all runs.
  double measured_s() const { return computed_.measured_s; }
  // Returns the rows that are left out because the model could not be computed.
  const RunCuts& cuts() const { return computed_.cuts; }
  // Returns the number of the last batch that the estimator has.
  int64_t sequence() const { return computed_.sequence; }
  // Gives the estimator the batches up to `sequence`, which the journal must keep, without
  // processing them, and lets go of their rows.
  absl::Status Store(int64_t sequence);
  // Returns the number of rows in memory.
  int64_t rows_in_memory() const {
    return intake_.waiting_rows() + computed_.store->rows_in_memory();
  }
  // Returns the bytes of a row of the problem in memory.
  static int64_t RowBytes(const ResolvedProblem& problem);
  // Returns about how many bytes of memory the session holds.
  int64_t memory_bytes() const;
  // Gives the estimator the batches up to `sequence`, or as many as have been taken, and processes
  // them. FAILED_PRECONDITION when the model cannot be computed at a row; EndFailedRun then lets
  // the session go on. UNAVAILABLE while the model cannot be asked; a later call goes on.
  absl::Status ProcessUpTo(int64_t sequence, const Stop& stop);
  // Leaves out the row at which ProcessUpTo has failed, for this reason, and the rest of its run.
  // The journal must keep all batches that the estimator has. Waits for the disk.
  absl::Status EndFailedRun(const absl::Status& reason, const Stop& stop);
  // Returns the estimate from everything processed. Computes it only once for the same last batch.
  // If rows were left out, or if no posterior is found, a diagnostic says so.
  absl::StatusOr<SharedEstimate> CurrentEstimate(const Stop& stop);
  // Gives the estimator every batch taken, without processing it, and calls `work` with the
  // estimator and the number of the last batch. Returns what `work` returns.
  using Work = std::function<absl::Status(Estimator& estimator, int64_t sequence)>;
  absl::Status WithEstimator(const Work& work);

 private:
  // Holds the estimator, and what belongs to the batches that it has been given.
  struct Computed {
    RunCuts cuts;
    std::shared_ptr<JournalStore> store;  // the estimator's; refers to the intake's problem
    std::unique_ptr<Estimator> estimator;
    int64_t sequence = 0;
    double measured_s = 0;
  };

  LoadedSession(v1::Problem problem, const ResolvedProblem& resolved, double reorder_window_s,
                int threads);
  void ReadFrom(const SessionJournal& journal, int64_t session);
  // Makes an estimator without batches that will leave out these rows.
  absl::StatusOr<Computed> Begin(RunCuts cuts, const Stop& stop);
  // Gives a new estimator the batches that the present one has, from the journal, without the rows
  // that `cuts` leave out, and the state of a snapshot that is not empty, if it is usable. After an
  // error everything is as before.
  absl::Status BeginAnew(RunCuts cuts, const EstimatorSnapshot& snapshot, const Stop& stop);
  // Gives an estimator without batches those that the journal keeps, up to batch `last`, through an
  // intake without batches.
  absl::Status Replay(int64_t last, BatchIntake& intake, Computed& computed,
                      const Stop& stop) const;
  // Takes the journal's snapshot and the cuts before it; nothing if it has none that is readable.
  std::pair<RunCuts, EstimatorSnapshot> Snapshot() const;
  absl::Status GiveUpTo(int64_t sequence);
  // Returns what `work` returns, and leaves what is computed in doubt if it throws.
  template <typename Function>
  std::invoke_result_t<Function> AllOrDoubt(const Function& work);
  static absl::Status Give(const TakenBatch& batch, Computed& computed);
  absl::StatusOr<Estimate> PriorEstimate(const absl::Status& reason, const Stop& stop) const;

  const v1::Problem problem_;
  const double reorder_window_s_;
  const int threads_;
  BatchIntake intake_;
  Computed computed_;
  const SessionJournal* journal_ = nullptr;  // null until Load or Attach
  int64_t number_ = 0;                       // of the session in the journal
  std::function<void(EstimatorSnapshot)> save_;
  int64_t failed_rows_ = -1;  // rows processed when EndFailedRun was called last
  bool in_doubt_ = false;
  SharedEstimate latest_;
};

}  // namespace polyest::internal
