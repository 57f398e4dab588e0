#pragma once

// Implements a session: batches go into the journal and into the estimator, estimates go to the
// observers. The estimator is in memory while it is used; otherwise it is rebuilt from the journal
// when it is needed.

#include <absl/status/statusor.h>

#include <functional>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>

#include "polyest/stop.h"
#include "polyest/v1/session_service.pb.h"
#include "server/execution/executor.h"
#include "server/journal/session_journal.h"
#include "server/sessions/batch_ledger.h"
#include "server/sessions/estimate_history.h"
#include "server/sessions/loaded_session.h"
#include "server/sessions/observer_list.h"
#include "server/sessions/session_activity.h"
#include "server/sessions/session_observer.h"
#include "server/sessions/session_services.h"
#include "server/sessions/stored_data.h"
#include "server/sessions/writer_lease.h"

namespace polyest::internal {

class Session : public std::enable_shared_from_this<Session> {
 public:
  using Clock = SessionActivity::Clock;

  // Makes a session that the journal keeps; `loaded` is given when the session has just been
  // created or imported.
  Session(const SessionServices& services, SessionHead head,
          std::unique_ptr<LoadedSession> loaded = nullptr);
  ~Session();

  const std::string& tenant() const { return head_.tenant; }
  const std::string& name() const { return head_.name; }
  double reorder_window_s() const { return head_.reorder_window_s; }
  int64_t number() const { return head_.number; }
  Strand& strand() { return *strand_; }

  // The following, down to Add, may be called from any thread.

  // Returns all fields but the problem.
  v1::Session Describe() const;
  // Read the problem, the batches and the history from the journal, as SessionJournal does. They
  // wait for the disk.
  absl::StatusOr<v1::Problem> ReadProblem() const {
    return services_.journal.ReadProblem(number());
  }
  absl::Status ReadBatches(int64_t after,
                           const std::function<absl::Status(const JournalBatch&)>& take) const {
    return services_.journal.ReadBatches(number(), after, take);
  }
  absl::StatusOr<std::vector<JournalHistoryPoint>> ReadHistory() const {
    return services_.journal.ReadHistory(number());
  }
  // Returns the place of the session after the last batch acknowledged.
  SessionPlace place() const { return ledger_.kept(); }
  // Returns the place of the session after the last batch taken, acknowledged or not yet.
  SessionPlace taken() const { return ledger_.taken(); }
  // Checks whether the tenant may hold about so many bytes of memory more.
  absl::Status CheckMemory(int64_t bytes) const;
  // Returns whether the estimator is in memory.
  bool loaded() const;
  // Returns the time since the session was last used; nothing while it is in use.
  std::optional<Clock::duration> IdleTime() const;

  // Claims the lease of the session's writer, as WriterLease::Claim does.
  absl::Status ClaimWriter(std::shared_ptr<SessionObserver> writer, const std::string& id) {
    return writer_.Claim(std::move(writer), id);
  }
  // Takes the lease back from a writer, if it holds the lease.
  void ReleaseWriter(const SessionObserver* writer) {
    if (writer_.Release(writer)) activity_.OnUsed();
  }

  // Goes on to the place that a journal shared with other daemons has told, if that is a later one
  // and this daemon does not own the session. The caller counts what is stored.
  void Follow(const SessionPlace& place);

  // Tells its observers and its writer that the session moves to another daemon.
  void SendAway();

  // Ends the session for everybody: tells its observers and its writer. Calls on it are NOT_FOUND
  // from here on.
  void Close();
  // NOT_FOUND when the session is closed.
  absl::Status CheckOpen() const;
  // Returns what asks for a stop when the session is closed.
  std::stop_token closing() const { return closing_.get_token(); }

  // Calls `done` when every batch up to `sequence` is kept, at once if all are, for a caller that
  // has seen `losses` losses; with the reason when one of them is lost or there were more losses.
  void WhenKept(int64_t sequence, uint64_t losses, BatchLedger::Done done) {
    ledger_.WhenKept(sequence, losses, std::move(done));
  }
  // Calls `done` when everything taken is kept, for a caller that has seen `losses` losses; with
  // the reason of the last loss if there were more since.
  void WhenAllKept(uint64_t losses, BatchLedger::Done done) {
    ledger_.WhenAllKept(losses, std::move(done));
  }
  // Returns how often batches that were taken could not be kept.
  uint64_t losses() const { return ledger_.losses(); }

  // Whether batches can be taken without loading the session first: it is in memory, no batch has
  // been lost since it was loaded, and this daemon owns it. Only a writer that has claimed the
  // lease may rely on that; without one, the session may be unloaded at any time.
  bool ReadyToTake() const;
  // Takes the batch, all of it or nothing, and gives it to the journal. The acknowledgement
  // returned may be sent once WhenKept reports its batch as kept. Computes no numerics: ProcessUpTo
  // does that. UNAVAILABLE when the session is not loaded. After batches were lost, refuses with
  // the reason of the loss until the session is loaded again. If `losses` is given, the number of
  // losses seen when a stream began, refuses for good, because what the stream sends next follows a
  // lost batch. Other refusals are those of BatchLedger::Check, BatchIntake::Take and the limits of
  // rows.
  absl::StatusOr<v1::Acknowledgement> Add(int64_t sequence, const v1::Measurements& batch,
                                          std::optional<uint64_t> losses = std::nullopt);

  // The following, down to Observe, may be called on the strand only. They bring the estimator back
  // into memory if they need it and it is not there.

  // Loads the estimator, which stays in memory at least as long as there is a writer.
  absl::Status Load(const Stop& stop) { return Loaded(stop).status(); }
  // Process everything added, or everything added up to batch `sequence`. Where the model cannot be
  // computed, the run ends (RunCuts), and a diagnostic of every further estimate says so.
  absl::Status Process(const Stop& stop) {
    return ProcessUpTo(std::numeric_limits<int64_t>::max(), stop);
  }
  absl::Status ProcessUpTo(int64_t sequence, const Stop& stop);
  // Returns the estimate from everything processed. It may be shown once WhenKept reports its last
  // batch as kept; a new estimate is then passed on to the observers.
  absl::StatusOr<SharedEstimate> LatestEstimate(const Stop& stop);
  // Processes everything added, then returns the estimate as LatestEstimate does.
  absl::StatusOr<SharedEstimate> CurrentEstimate(const Stop& stop);
  // Processes everything added, then returns which rows are left out of it.
  absl::StatusOr<RunCuts> Cuts(const Stop& stop);
  // Returns the history of the estimates. Loads nothing but the history.
  absl::StatusOr<v1::EstimateHistory> History();
  // Processes everything added and calls `work` with the estimator, which has everything added and
  // may have yet to process the latest, and with the number of the last batch added. Returns what
  // `work` returns.
  absl::Status WithEstimator(const LoadedSession::Work& work, const Stop& stop);
  // Passes on to `observer` the present estimate, if there are samples, and every new one from here
  // on. NOT_FOUND when the session is closed.
  absl::Status Observe(std::shared_ptr<SessionObserver> observer, const Stop& stop);
  // Removes an observer. May be called from any thread, as may the next.
  void Unobserve(const SessionObserver* observer) {
    observers_->Remove(observer);
    activity_.OnUsed();
  }
  // Calls `then`, soon, after the observers have been given all estimates that are kept by now.
  void AfterAnnounced(std::function<void()> then) { observers_->AfterAnnounced(std::move(then)); }
  bool observed() const { return observers_->size() > 0; }
  // Weighs what is in memory of the session. May be called on the strand, or before others know
  // the session.
  void Weigh();
  // Takes the estimator out of memory if the session is not in use and has not been for the time
  // given: it may have been used since somebody found it idle. May be called on the strand only.
  void Unload(Clock::duration idle = Clock::duration::zero());

 private:
  // Measures the time of a computation.
  class TimedComputation;
  // Holds what is in memory of the session, and the number of losses that it takes into account.
  struct InMemory {
    std::shared_ptr<LoadedSession> loaded;  // null: the session is not loaded
    uint64_t losses = 0;
  };

  // Makes this daemon the session's owner if it may be another one's.
  absl::Status Own();
  // Checks that the next batch, serialized in so many bytes, keeps to the limits, and counts
  // it as stored.
  absl::Status TakeStorage(const SessionPlace& place, const v1::Measurements& batch,
                           int64_t bytes) const;
  void ReleaseStorage(const StoredAmount& amount) const;
  // Returns the loaded session; loads it first if need be. Batches taken may wait in it for the
  // numerics.
  absl::StatusOr<std::shared_ptr<LoadedSession>> Loaded(const Stop& stop);
  // Appends a batch to the journal. Once it is kept, counts its rows, its values and its seconds of
  // measurements.
  void Keep(JournalEntry entry, uint64_t losses, int64_t rows, int64_t values, double measured_s);
  absl::Status ProcessIn(LoadedSession& loaded, int64_t sequence, const Stop& stop);
  // Waits until the journal keeps what the estimator has, as BatchLedger::AwaitKept does.
  absl::Status AwaitKept(const LoadedSession& loaded, const Stop& stop);
  InMemory Present() const;
  void Replace(InMemory in_memory);
  void Drop();
  void UnloadIfIdle(Clock::duration at_least);
  absl::Status LoadHistory();
  // Adds a new estimate, which took so long to compute, to the history, counts it, and passes it on
  // to the observers once its batches are kept.
  void Publish(const SharedEstimate& estimate, Clock::duration duration);
  void AnnounceWhenKept(const SharedEstimate& estimate);
  void CountEstimate(const v1::Estimate& estimate, Clock::duration duration);

  const SessionServices services_;
  const SessionHead head_;
  const std::shared_ptr<Strand> strand_;
  BatchLedger ledger_;

  // Used on the strand only.
  SharedEstimate published_;                // the last estimate given to the observers
  std::optional<EstimateHistory> history_;  // none until an estimate is passed on

  std::stop_source closing_;
  WriterLease writer_;
  const std::shared_ptr<ObserverList> observers_;
  SessionActivity activity_;

  std::mutex taking_;  // held while a batch is taken

  mutable std::mutex mutex_;
  InMemory in_memory_;  // changed on the strand only
};

}  // namespace polyest::internal
