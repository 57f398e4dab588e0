#pragma once

// A session: batches into the journal and the estimator, estimates to those who watch. Its
// estimator is in memory while it is used, and otherwise made anew from the journal.

#include <absl/status/statusor.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/common/stop.h"
#include "core/fmu/model_library.h"
#include "polyest/v1/estimation_service.pb.h"
#include "server/execution/executor.h"
#include "server/journal/session_journal.h"
#include "server/sessions/batch_ledger.h"
#include "server/sessions/limits.h"
#include "server/sessions/loaded_session.h"
#include "server/sessions/memory_limit.h"
#include "server/sessions/stored_rows.h"

namespace polyest {

class Metrics;

// Called from the session's strand, from the journal, or from whoever closes it; must not wait.
class SessionObserver {
 public:
  virtual ~SessionObserver() = default;
  virtual void OnEstimate(const SharedEstimate& estimate) = 0;
  // The last call.
  virtual void OnClosed() = 0;
  // To a writer; the last call.
  virtual void OnReplaced() {}
};

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
  using Clock = std::chrono::steady_clock;

  // One that the journal keeps; `loaded` when it has just been made.
  Session(const SessionServices& services, SessionHead head,
          std::unique_ptr<LoadedSession> loaded = nullptr);

  const std::string& tenant() const { return head_.tenant; }
  const std::string& name() const { return head_.name; }
  int64_t number() const { return head_.number; }
  Strand& strand() { return *strand_; }

  // From any thread.
  // Without the problem.
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
  bool loaded() const;
  // Since it was last used; none while it is in use.
  std::optional<Clock::duration> IdleTime() const;

  // One writer at a time: ABORTED while another has it. A writer hears of the closing, and of being
  // replaced by one with the same id that is not empty.
  absl::Status ClaimWriter(std::shared_ptr<SessionObserver> writer, const std::string& id);
  // Nothing when it was replaced.
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
  absl::StatusOr<v1::Acknowledgement> Add(int64_t sequence, const v1::Measurements& batch);

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
  // The posterior in detail, from everything added.
  absl::StatusOr<v1::GetPosteriorResponse> CurrentPosterior(const v1::GetPosteriorRequest& request,
                                                            const Stop& stop);
  absl::StatusOr<v1::ProfileCostResponse> CurrentProfiles(const v1::ProfileCostRequest& request,
                                                          const Stop& stop);
  absl::StatusOr<v1::SweepRegularizationResponse> CurrentRegularizationSweep(
      const v1::SweepRegularizationRequest& request, const Stop& stop);
  // Passes on the present estimate, if there are samples, and every new one from here on.
  absl::Status Observe(std::shared_ptr<SessionObserver> observer, const Stop& stop);
  void Unobserve(const SessionObserver* observer);
  bool observed() const;
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
  void PassOn(const SharedEstimate& estimate);
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

  std::mutex taking_;  // held while a batch is taken

  mutable std::mutex mutex_;
  InMemory in_memory_;  // changed on the strand only
  bool closed_ = false;
  std::shared_ptr<SessionObserver> writer_;
  std::string writer_id_;
  std::vector<std::shared_ptr<SessionObserver>> observers_;
  Clock::time_point last_use_ = Clock::now();
  v1::Session::Activity activity_;
  // Seconds of measurements processed, and computed for them, since the estimator is in memory.
  double measured_s_ = 0;
  double computed_s_ = 0;
  double measured_before_s_ = 0;  // and before that
  int64_t processed_ = 0;         // the last batch
};

}  // namespace polyest
