#include "server/sessions/session.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <utility>

#include "core/common/status.h"
#include "server/journal/digest.h"
#include "server/sessions/row_limits.h"
#include "server/telemetry/metrics.h"
#include "server/telemetry/structured_log.h"

namespace polyest {

class Session::Computing {
 public:
  explicit Computing(Session& session) : session_(session) {}
  ~Computing() {
    const std::chrono::duration<double> spent = Clock::now() - begin_;
    if (session_.services_.metrics != nullptr) {
      session_.services_.metrics->CountComputing(spent.count());
    }
    const std::lock_guard lock(session_.mutex_);
    session_.activity_.set_compute_time(session_.activity_.compute_time() + spent.count());
    session_.computed_s_ += spent.count();
    session_.measured_s_ = session_.loaded_->measured_s();
    session_.last_use_ = Clock::now();
  }
  Computing(const Computing&) = delete;
  Computing& operator=(const Computing&) = delete;

 private:
  Session& session_;
  const Clock::time_point begin_ = Clock::now();
};

Session::Session(const SessionServices& services, SessionHead head,
                 std::unique_ptr<LoadedSession> loaded)
    : services_(services),
      head_(std::move(head)),
      strand_(std::make_shared<Strand>(services.executor, head_.tenant + "/sessions")),
      ledger_(head_.place),
      loaded_(std::move(loaded)) {
  activity_.set_loaded(loaded_ != nullptr);
  if (loaded_ != nullptr) loaded_->SaveSnapshots(services.journal, number());
}

v1::Session Session::Describe() const {
  v1::Session session;
  session.set_name(name());
  *session.mutable_create_time() = head_.create_time;
  const SessionPlace place = ledger_.kept();
  session.set_last_sequence(place.sequence);
  session.set_samples(place.samples);
  session.set_last_time(place.last_row.time_s);
  session.set_last_run(place.last_row.run);
  const std::lock_guard lock(mutex_);
  v1::Session::Activity& activity = *session.mutable_activity();
  activity = activity_;
  activity.set_has_writer(writer_ != nullptr);
  activity.set_watchers(static_cast<int32_t>(observers_.size()));
  activity.set_batches(place.sequence - head_.place.sequence);
  if (measured_s_ > 0) activity.set_real_time_factor(measured_s_ / computed_s_);
  const std::chrono::duration<double> idle = Clock::now() - last_use_;
  activity.set_idle_time(idle.count());
  return session;
}

bool Session::loaded() const {
  const std::lock_guard lock(mutex_);
  return activity_.loaded();
}

std::optional<Session::Clock::duration> Session::IdleTime() const {
  if (!ledger_.all_kept()) return std::nullopt;
  const std::lock_guard lock(mutex_);
  if (writer_ != nullptr || !observers_.empty()) return std::nullopt;
  return Clock::now() - last_use_;
}

absl::Status Session::ClaimWriter(std::shared_ptr<SessionObserver> writer, const std::string& id) {
  std::shared_ptr<SessionObserver> replaced;
  {
    const std::lock_guard lock(mutex_);
    if (closed_) return absl::NotFoundError(absl::StrCat(name(), " has been deleted"));
    if (writer_ != nullptr && (id.empty() || id != writer_id_)) {
      return absl::AbortedError(absl::StrCat(name(), " has a writer already; one at a time"));
    }
    replaced = std::exchange(writer_, std::move(writer));
    writer_id_ = id;
  }
  if (replaced != nullptr) replaced->OnReplaced();
  return absl::OkStatus();
}

void Session::ReleaseWriter(const SessionObserver* writer) {
  std::shared_ptr<SessionObserver> released;
  const std::lock_guard lock(mutex_);
  if (writer_.get() != writer) return;
  released.swap(writer_);
  last_use_ = Clock::now();
}

void Session::Close() {
  std::vector<std::shared_ptr<SessionObserver>> observers;
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    observers.swap(observers_);
    if (writer_ != nullptr) observers.push_back(writer_);
  }
  for (const auto& observer : observers) observer->OnClosed();
}

absl::Status Session::CheckOpen() const {
  const std::lock_guard lock(mutex_);
  if (closed_) return absl::NotFoundError(absl::StrCat(name(), " has been deleted"));
  return absl::OkStatus();
}

absl::StatusOr<LoadedSession*> Session::Loaded(const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(CheckOpen());
  const uint64_t losses = ledger_.losses();
  if (loaded_ != nullptr && losses == losses_) return loaded_.get();
  POLYEST_RETURN_IF_ERROR(services_.memory.Check());
  loaded_ = nullptr;
  passed_on_ = nullptr;
  // After a loss nothing is under way, and only this strand takes more.
  POLYEST_ASSIGN_OR_RETURN(loaded_, LoadedSession::Load(services_.journal, number(), ledger_.kept(),
                                                        services_.models, stop));
  loaded_->SaveSnapshots(services_.journal, number());
  losses_ = losses;
  Log(spdlog::level::info, "session loaded", {{"session", name()}, {"tenant", tenant()}});
  const std::lock_guard lock(mutex_);
  computed_s_ = 0;
  activity_.set_loaded(true);
  return loaded_.get();
}

absl::Status Session::TakeRoom(const LoadedSession& loaded, const v1::Measurements& batch) const {
  POLYEST_RETURN_IF_ERROR(CheckRows(services_.limits, loaded.place(), batch));
  POLYEST_RETURN_IF_ERROR(CheckRuns(services_.limits.problem, loaded.resolved(), batch));
  if (services_.rows == nullptr) return absl::OkStatus();
  return services_.rows->Take(number(), tenant(), batch.time_size());
}

void Session::ReleaseRoom(int64_t rows) const {
  if (services_.rows != nullptr) services_.rows->Release(number(), rows);
}

absl::StatusOr<v1::Acknowledgement> Session::Add(int64_t sequence, const v1::Measurements& batch,
                                                 const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(LoadedSession* const loaded, Loaded(stop));
  JournalEntry entry;
  entry.session = number();
  entry.measurements = DeterministicBytes(batch);
  entry.digest = Digest(entry.measurements);
  POLYEST_ASSIGN_OR_RETURN(const BatchLedger::Kind kind,
                           ledger_.Check(sequence, entry.digest, [this](int64_t kept) {
                             return services_.journal.ReadDigest(number(), kept);
                           }));
  if (kind == BatchLedger::Kind::kNext) {
    POLYEST_RETURN_IF_ERROR(TakeRoom(*loaded, batch));
    absl::Cleanup release_room = [&] { ReleaseRoom(batch.time_size()); };
    const int64_t samples = loaded->place().samples;
    const double measured_s = loaded->measured_s();
    POLYEST_RETURN_IF_ERROR(loaded->Append(batch));
    entry.place = loaded->place();
    POLYEST_RETURN_IF_ERROR(ledger_.Take(entry.place, entry.digest, losses_));
    const int64_t values = entry.place.samples - samples;
    std::move(release_room).Cancel();
    Keep(std::move(entry), batch.time_size(), values, loaded->measured_s() - measured_s);
  }
  v1::Acknowledgement acknowledgement;
  acknowledgement.set_sequence(sequence);
  acknowledgement.set_samples(loaded->place().samples);
  return acknowledgement;
}

void Session::Keep(JournalEntry entry, int64_t rows, int64_t values, double measured_s) {
  const int64_t sequence = entry.place.sequence;
  services_.journal.Append(
      std::move(entry), [self = shared_from_this(), losses = losses_, sequence, rows, values,
                         measured_s, begin = Clock::now()](const absl::Status& kept) {
        const std::chrono::duration<double> duration = Clock::now() - begin;
        if (Metrics* const metrics = self->services_.metrics; metrics != nullptr && kept.ok()) {
          metrics->Count(Metrics::Batch{rows, values, measured_s, duration.count()});
        }
        if (!kept.ok()) self->ReleaseRoom(rows);
        self->ledger_.Settle(losses, sequence, kept);
      });
}

absl::Status Session::Process(const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(LoadedSession* const loaded, Loaded(stop));
  const Computing computing(*this);
  return loaded->Process(stop);
}

absl::StatusOr<SharedEstimate> Session::CurrentEstimate(const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(LoadedSession* const loaded, Loaded(stop));
  SharedEstimate latest;
  const Clock::time_point begin = Clock::now();
  {
    const Computing computing(*this);
    POLYEST_ASSIGN_OR_RETURN(latest, loaded->CurrentEstimate(stop));
  }
  if (latest == passed_on_) return latest;
  passed_on_ = latest;
  CountEstimate(*latest, Clock::now() - begin);
  WhenKept(latest->sequence(), [self = shared_from_this(), latest](const absl::Status& kept) {
    if (kept.ok()) self->PassOn(latest);
  });
  return latest;
}

void Session::CountEstimate(const v1::Estimate& estimate, Clock::duration duration) {
  const int64_t reexpansions = estimate.expansion().reexpansions();
  const std::lock_guard lock(mutex_);
  if (services_.metrics != nullptr) {
    services_.metrics->Count(
        Metrics::NewEstimate{std::chrono::duration<double>(duration).count(),
                             std::max<int64_t>(0, reexpansions - activity_.reexpansions())});
  }
  activity_.set_estimates(activity_.estimates() + 1);
  activity_.set_reexpansions(reexpansions);
}

void Session::PassOn(const SharedEstimate& estimate) {
  std::vector<std::shared_ptr<SessionObserver>> observers;
  {
    const std::lock_guard lock(mutex_);
    observers = observers_;
  }
  for (const auto& observer : observers) observer->OnEstimate(estimate);
}

absl::StatusOr<v1::GetPosteriorResponse> Session::CurrentPosterior(
    const v1::GetPosteriorRequest& request, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(LoadedSession* const loaded, Loaded(stop));
  const Computing computing(*this);
  return loaded->CurrentPosterior(request, stop);
}

absl::StatusOr<v1::ProfileCostResponse> Session::CurrentProfiles(
    const v1::ProfileCostRequest& request, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(LoadedSession* const loaded, Loaded(stop));
  const Computing computing(*this);
  return loaded->CurrentProfiles(request, stop);
}

absl::StatusOr<v1::SweepRegularizationResponse> Session::CurrentRegularizationSweep(
    const v1::SweepRegularizationRequest& request, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(LoadedSession* const loaded, Loaded(stop));
  const Computing computing(*this);
  return loaded->CurrentRegularizationSweep(request, stop);
}

absl::Status Session::Observe(std::shared_ptr<SessionObserver> observer, const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(CheckOpen());
  if (ledger_.taken().samples > 0) {
    POLYEST_ASSIGN_OR_RETURN(const SharedEstimate present, CurrentEstimate(stop));
    WhenKept(present->sequence(), [observer, present](const absl::Status& kept) {
      if (kept.ok()) observer->OnEstimate(present);
    });
  }
  const std::lock_guard lock(mutex_);
  if (closed_) return absl::NotFoundError(absl::StrCat(name(), " has been deleted"));
  observers_.push_back(std::move(observer));
  return absl::OkStatus();
}

void Session::Unobserve(const SessionObserver* observer) {
  const std::lock_guard lock(mutex_);
  std::erase_if(observers_, [&](const auto& one) { return one.get() == observer; });
  last_use_ = Clock::now();
}

bool Session::observed() const {
  const std::lock_guard lock(mutex_);
  return !observers_.empty();
}

void Session::Unload() {
  if (!IdleTime()) return;
  loaded_ = nullptr;
  passed_on_ = nullptr;
  Log(spdlog::level::info, "session unloaded", {{"session", name()}, {"tenant", tenant()}});
  const std::lock_guard lock(mutex_);
  activity_.set_loaded(false);
}

}  // namespace polyest
