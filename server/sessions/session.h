#pragma once

// A session: batches into the journal and the estimator, estimates to those who watch. Its
// estimator is in memory while it is used, and otherwise made anew from the journal.

#include <absl/status/statusor.h>

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "core/fmu/model_library.h"
#include "polyest/stop.h"
#include "polyest/v1/session_service.pb.h"
#include "server/execution/executor.h"
#include "server/journal/session_journal.h"
#include "server/sessions/batch_ledger.h"
#include "server/sessions/limits.h"
#include "server/sessions/loaded_session.h"
#include "server/sessions/memory_limit.h"
#include "server/sessions/observer_list.h"
#include "server/sessions/session_activity.h"
#include "server/sessions/session_observer.h"
#include "server/sessions/stored_rows.h"
#include "server/sessions/writer_lease.h"

namespace polyest::internal {

class Metrics;

// What all sessions need; outlives them.
struct SessionServices {
  Executor& executor;
  SessionJournal& journal;
  const ModelLibrary& models;
  SessionLimits limits = {};
  Metrics* metrics = nullptr;  // null: nothing is counted
  MemoryLimit memory = MemoryLimit();
  // Null: rows are not counted; the registry does.
  std::shared_ptr<StoredRows> rows = nullptr;
};

class Session : public std::enable_shared_from_this<Session> {
 public:
  using Clock = SessionActivity::Clock;

  // One that the journal keeps; `loaded` when it has just been made.
  Session(const SessionServices& services, SessionHead head,
          std::unique_ptr<LoadedSession> loaded = nullptr);

  const std::string& tenant() const { return head_.tenant; }
  const std::string& name() const { return head_.name; }
  int64_t number() const { return head_.number; }
  Strand& strand() { return *strand_; }

  // From any thread.
  // All fields but the problem.
  v1::Session Describe() const;
  absl::StatusOr<v1::Problem> ReadProblem() const {
    return services_.journal.ReadProblem(number());
  }
  absl::Status ReadBatches(int64_t after,
                           const std::function<absl::Status(const JournalBatch&)>& take) const {
    return services_.journal.ReadBatches(number(), after, take);
  }
  // Batches acknowledged.
  SessionPlace place() const { return ledger_.kept(); }
  // Batches taken, acknowledged or about to be.
  SessionPlace taken() const { return ledger_.taken(); }
  bool loaded() const { return activity_.loaded(); }
  // Since it was last used; none while it is in use.
  std::optional<Clock::duration> IdleTime() const;

  // As WriterLease::Claim.
  absl::Status ClaimWriter(std::shared_ptr<SessionObserver> writer, const std::string& id) {
    return writer_.Claim(std::move(writer), id);
  }
  void ReleaseWriter(const SessionObserver* writer);

  // Ends the session for everybody: calls on it are NOT_FOUND from here on.
  void Close();

  // Calls `done` when every batch up to this one is kept, at once if it is; or will not be, and
  // why.
  void WhenKept(int64_t sequence, BatchLedger::Done done) {
    ledger_.WhenKept(sequence, std::move(done));
  }
  // The same of everything taken, where `losses` were seen before it was looked at.
  void WhenAllKept(uint64_t losses, BatchLedger::Done done) {
    ledger_.WhenAllKept(losses, std::move(done));
  }
  // How often batches were taken and then not kept.
  uint64_t losses() const { return ledger_.losses(); }

  // Takes the batch, all of it or nothing. It may be acknowledged as the answer says WhenKept its
  // sequence. No numerics: ProcessUpTo does them. UNAVAILABLE when the session is not loaded.
  // After batches were lost, refuses with the reason of the loss: until the session is loaded
  // again, or for good where `losses` (those seen when a stream began) is given, because what the
  // stream sends next follows a batch that is lost.
  absl::StatusOr<v1::Acknowledgement> Add(int64_t sequence, const v1::Measurements& batch,
                                          std::optional<uint64_t> losses = std::nullopt);

  // The following only on the strand. Each brings the estimator back into memory if it is not
  // there.

  // As it stays at least as long as there is a writer.
  absl::Status Load(const Stop& stop) { return Loaded(stop).status(); }
  // Everything added, or what of it was added up to batch `sequence`.
  absl::Status Process(const Stop& stop);
  absl::Status ProcessUpTo(int64_t sequence, const Stop& stop);
  // The estimate from everything processed; it may be told WhenKept its sequence. A new one is
  // passed on to the observers then.
  absl::StatusOr<SharedEstimate> LatestEstimate(const Stop& stop);
  // The same from everything added.
  absl::StatusOr<SharedEstimate> CurrentEstimate(const Stop& stop);
  // Calls `work` with the estimator, which has everything added and has yet to process it, and with
  // the last batch added. Returns what `work` returns.
  absl::Status WithEstimator(const LoadedSession::Work& work, const Stop& stop);
  // Passes on the present estimate, if there are samples, and every new one from here on.
  absl::Status Observe(std::shared_ptr<SessionObserver> observer, const Stop& stop);
  void Unobserve(const SessionObserver* observer);
  bool observed() const { return observers_.size() > 0; }
  // Takes the estimator out of memory if the session is not in use.
  void Unload();

 private:
  // Times what is computed.
  class Computing;
  // What is in memory of it, and the losses of batches that this knows of.
  struct InMemory {
    std::shared_ptr<LoadedSession> loaded;  // null: nothing
    uint64_t losses = 0;
  };

  absl::Status CheckOpen() const;
  // Whether the next batch keeps to the limits; its rows are taken then.
  absl::Status TakeRoom(const SessionPlace& place, const v1::Measurements& batch) const;
  void ReleaseRoom(int64_t rows) const;
  // What is in memory, brought there if need be; batches taken may wait in it for the numerics.
  absl::StatusOr<std::shared_ptr<LoadedSession>> Loaded(const Stop& stop);
  // In the journal, with what is to be counted once it is there.
  void Keep(JournalEntry entry, uint64_t losses, int64_t rows, int64_t values, double measured_s);
  InMemory Present() const;
  void Replace(InMemory in_memory);
  void CountEstimate(const v1::Estimate& estimate, Clock::duration duration);

  const SessionServices services_;
  const SessionHead head_;
  const std::shared_ptr<Strand> strand_;
  BatchLedger ledger_;

  SharedEstimate passed_on_;  // the strand's own

  std::atomic<bool> closed_ = false;
  WriterLease writer_;
  ObserverList observers_;
  SessionActivity activity_;

  std::mutex taking_;  // held while a batch is taken

  mutable std::mutex mutex_;
  InMemory in_memory_;  // changed on the strand only
};

}  // namespace polyest::internal
