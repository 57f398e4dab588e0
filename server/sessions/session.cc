#include "server/sessions/session.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "core/common/status.h"
#include "server/digest/digest.h"
#include "server/sessions/create_time.h"
#include "server/sessions/row_limits.h"
#include "server/telemetry/metrics.h"
#include "server/telemetry/structured_log.h"

namespace polyest::internal {

class Session::TimedComputation {
 public:
  TimedComputation(Session& session, const LoadedSession& loaded)
      : session_(session), loaded_(loaded) {
    session_.activity_.OnComputing();
  }
  ~TimedComputation() {
    const Clock::duration spent = Clock::now() - begin_;
    if (session_.services_.metrics != nullptr) {
      session_.services_.metrics->CountComputing(std::chrono::duration<double>(spent).count());
    }
    session_.activity_.OnComputed(spent, loaded_.sequence(), loaded_.measured_s());
    session_.Weigh();
  }
  TimedComputation(const TimedComputation&) = delete;
  TimedComputation& operator=(const TimedComputation&) = delete;

 private:
  Session& session_;
  const LoadedSession& loaded_;
  const Clock::time_point begin_ = Clock::now();
};

Session::Session(const SessionServices& services, SessionHead head,
                 std::unique_ptr<LoadedSession> loaded)
    : services_(services),
      head_(std::move(head)),
      strand_(std::make_shared<Strand>(services.executor, head_.tenant + "/sessions")),
      ledger_(head_.place),
      writer_(head_.name),
      observers_(std::make_shared<ObserverList>(head_.name, services.executor,
                                                head_.tenant + "/sessions")) {
  if (loaded == nullptr) return;
  loaded->Attach(services.journal, number(), services.StorageForSnapshots(number(), tenant()));
  Replace({std::move(loaded), 0});
}

Session::~Session() {
  if (services_.tenant_memory != nullptr) services_.tenant_memory->Forget(number());
}

v1::Session Session::Describe() const {
  v1::Session session;
  session.set_name(name());
  *session.mutable_create_time() = NearestWithJsonForm(head_.create_time);
  session.set_reorder_window_s(head_.reorder_window_s);
  const SessionPlace place = ledger_.kept();
  session.set_last_sequence(place.sequence);
  session.set_sample_count(place.samples);
  session.set_last_time_s(place.last_row.time_s);
  session.set_last_run(place.last_row.run);
  const SessionActivity::Summary summary = activity_.Summarize();
  v1::Session::Activity& activity = *session.mutable_activity();
  activity.set_loaded(loaded());
  activity.set_has_writer(writer_.is_held());
  activity.set_watcher_count(static_cast<int32_t>(observers_->size()));
  activity.set_batch_count(place.sequence - head_.place.sequence);
  activity.set_estimate_count(summary.estimates);
  activity.set_reexpansion_count(summary.reexpansions);
  activity.set_compute_time_s(summary.compute_s);
  if (summary.sequence) {
    activity.set_unprocessed_batch_count(std::max<int64_t>(0, place.sequence - *summary.sequence));
  }
  activity.set_real_time_factor(summary.real_time_factor);
  activity.set_idle_time_s(std::chrono::duration<double>(activity_.idle()).count());
  return session;
}

std::optional<Session::Clock::duration> Session::IdleTime() const {
  const bool used = !ledger_.all_kept() || writer_.is_held() || observed() || activity_.computing();
  if (used) return std::nullopt;
  return activity_.idle();
}

void Session::Close() {
  closing_.request_stop();
  for (const auto& observer : observers_->Close()) observer->OnClosed();
  if (const auto writer = writer_.Close(); writer != nullptr) writer->OnClosed();
}

void Session::SendAway() {
  for (const auto& observer : observers_->All()) observer->OnMoved();
  if (const auto writer = writer_.writer(); writer != nullptr) writer->OnMoved();
}

absl::Status Session::CheckOpen() const {
  if (!closing_.stop_requested()) return absl::OkStatus();
  return absl::NotFoundError(absl::StrCat(name(), " has been deleted"));
}

absl::Status Session::TakeStorage(const SessionPlace& place, const v1::Measurements& batch,
                                  int64_t bytes) const {
  POLYEST_RETURN_IF_ERROR(CheckRows(services_.limits, place, batch));
  if (services_.stored == nullptr) return absl::OkStatus();
  return services_.stored->Take(number(), tenant(), {batch.time_s_size(), bytes});
}

void Session::ReleaseStorage(const StoredAmount& amount) const {
  if (services_.stored != nullptr) services_.stored->Release(number(), amount);
}

absl::StatusOr<v1::Acknowledgement> Session::Add(int64_t sequence, const v1::Measurements& batch,
                                                 std::optional<uint64_t> losses) {
  JournalEntry entry;
  entry.session = number();
  entry.measurements = DeterministicBytes(batch);
  entry.digest = Digest(entry.measurements);
  const std::lock_guard taking(taking_);
  POLYEST_RETURN_IF_ERROR(CheckOpen());
  const InMemory present = Present();
  POLYEST_ASSIGN_OR_RETURN(
      const BatchLedger::Kind kind,
      ledger_.Check(sequence, entry.digest, losses.value_or(present.losses),
                    [this](int64_t kept) { return services_.journal.ReadDigest(number(), kept); }));
  if (present.loaded == nullptr) {
    return absl::UnavailableError(name() + " is not loaded; try again");
  }
  BatchIntake& intake = present.loaded->intake();
  if (kind == BatchLedger::Kind::kNext) {
    const SessionPlace before = intake.place();
    const double measured_s = intake.measured_s();
    const auto bytes = static_cast<int64_t>(entry.measurements.size());
    // A rig whose batches are computed as fast as they come, and in order, needs no more memory.
    const bool held = intake.waiting_rows() > 0 || intake.held_bytes() > 0;
    if (held) POLYEST_RETURN_IF_ERROR(CheckMemory(bytes));
    POLYEST_RETURN_IF_ERROR(TakeStorage(before, batch, bytes));
    absl::Cleanup release = [&] { ReleaseStorage({batch.time_s_size(), bytes}); };
    const auto record = [&](const SessionPlace& place) {
      entry.place = place;
      return ledger_.Take(place, entry.digest, present.losses);
    };
    POLYEST_RETURN_IF_ERROR(intake.Take(batch, services_.limits.problem, record));
    const int64_t values = entry.place.samples - before.samples;
    std::move(release).Cancel();
    if (services_.tenant_memory != nullptr) services_.tenant_memory->Add(number(), bytes);
    Keep(std::move(entry), present.losses, batch.time_s_size(), values,
         intake.measured_s() - measured_s);
  }
  v1::Acknowledgement acknowledgement;
  acknowledgement.set_sequence(sequence);
  acknowledgement.set_sample_count(intake.place().samples);
  return acknowledgement;
}

void Session::Keep(JournalEntry entry, uint64_t losses, int64_t rows, int64_t values,
                   double measured_s) {
  const int64_t sequence = entry.place.sequence;
  const StoredAmount amount{rows, static_cast<int64_t>(entry.measurements.size())};
  services_.journal.Append(
      std::move(entry), [self = shared_from_this(), losses, sequence, amount, values, measured_s,
                         begin = Clock::now()](const absl::Status& kept) {
        const std::chrono::duration<double> duration = Clock::now() - begin;
        if (Metrics* const metrics = self->services_.metrics; metrics != nullptr && kept.ok()) {
          metrics->Count(Metrics::Batch{amount.rows, values, measured_s, duration.count()});
        }
        if (!kept.ok()) self->ReleaseStorage(amount);
        self->ledger_.Settle(losses, sequence, kept);
      });
}

absl::Status Session::ProcessUpTo(int64_t sequence, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const auto loaded, Loaded(stop));
  const TimedComputation computation(*this, *loaded);
  return ProcessIn(*loaded, sequence, stop);
}

absl::Status Session::ProcessIn(LoadedSession& loaded, int64_t sequence, const Stop& stop) {
  while (true) {
    const absl::Status processed = loaded.ProcessUpTo(sequence, stop);
    if (!absl::IsFailedPrecondition(processed)) return processed;
    POLYEST_RETURN_IF_ERROR(stop.Check());
    POLYEST_RETURN_IF_ERROR(AwaitKept(loaded, stop));
    POLYEST_RETURN_IF_ERROR(loaded.EndFailedRun(processed, stop));
    Log(spdlog::level::warn, "run ended, because the model could not be computed",
        {{"session", name()}, {"tenant", tenant()}});
  }
}

absl::Status Session::AwaitKept(const LoadedSession& loaded, const Stop& stop) {
  return ledger_.AwaitKept(loaded.sequence(), Present().losses, stop);
}

absl::StatusOr<SharedEstimate> Session::CurrentEstimate(const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(Process(stop));
  return LatestEstimate(stop);
}

absl::StatusOr<SharedEstimate> Session::LatestEstimate(const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const auto loaded, Loaded(stop));
  SharedEstimate latest;
  const Clock::time_point begin = Clock::now();
  {
    const TimedComputation computation(*this, *loaded);
    POLYEST_ASSIGN_OR_RETURN(latest, loaded->CurrentEstimate(stop));
  }
  if (latest != published_) Publish(latest, Clock::now() - begin);
  return latest;
}

void Session::Publish(const SharedEstimate& estimate, Clock::duration duration) {
  published_ = estimate;
  // A history that cannot be read is no reason to withhold an estimate.
  if (LoadHistory().ok()) {
    if (auto point = history_->Add(*estimate)) {
      services_.journal.SaveHistoryPoint(number(), *std::move(point), history_->stride());
    }
  }
  CountEstimate(*estimate, duration);
  AnnounceWhenKept(estimate);
}

void Session::AnnounceWhenKept(const SharedEstimate& estimate) {
  WhenKept(estimate->sequence(), Present().losses,
           [observers = observers_, estimate](const absl::Status& kept) {
             if (kept.ok()) observers->Announce(estimate);
           });
}

absl::Status Session::LoadHistory() {
  if (history_) return absl::OkStatus();
  POLYEST_ASSIGN_OR_RETURN(const auto kept, services_.journal.ReadHistory(number()));
  history_.emplace(kept);
  return absl::OkStatus();
}

absl::StatusOr<v1::EstimateHistory> Session::History() {
  POLYEST_RETURN_IF_ERROR(CheckOpen());
  POLYEST_ASSIGN_OR_RETURN(const auto kept, services_.journal.ReadHistory(number()));
  return history_.value_or(EstimateHistory()).Points(kept);
}

void Session::CountEstimate(const v1::Estimate& estimate, Clock::duration duration) {
  const int64_t reexpansions = activity_.OnEstimate(estimate.expansion().reexpansions());
  if (services_.metrics != nullptr) {
    services_.metrics->Count(
        Metrics::NewEstimate{std::chrono::duration<double>(duration).count(), reexpansions});
  }
}

absl::StatusOr<RunCuts> Session::Cuts(const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(Process(stop));
  POLYEST_ASSIGN_OR_RETURN(const auto loaded, Loaded(stop));
  return loaded->cuts();
}

absl::Status Session::WithEstimator(const LoadedSession::Work& work, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const auto loaded, Loaded(stop));
  const TimedComputation computation(*this, *loaded);
  POLYEST_RETURN_IF_ERROR(ProcessIn(*loaded, std::numeric_limits<int64_t>::max(), stop));
  return loaded->WithEstimator(work);
}

absl::Status Session::Observe(std::shared_ptr<SessionObserver> observer, const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(CheckOpen());
  SharedEstimate present;
  if (ledger_.taken().samples > 0) {
    POLYEST_ASSIGN_OR_RETURN(present, CurrentEstimate(stop));
  }
  POLYEST_RETURN_IF_ERROR(observers_->Add(std::move(observer)));
  if (present != nullptr) AnnounceWhenKept(present);
  return absl::OkStatus();
}

}  // namespace polyest::internal
