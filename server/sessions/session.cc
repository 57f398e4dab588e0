#include "server/sessions/session.h"

#include <absl/cleanup/cleanup.h>
#include <absl/strings/str_cat.h>

#include <algorithm>
#include <limits>
#include <utility>

#include "core/common/status.h"
#include "server/journal/digest.h"
#include "server/sessions/row_limits.h"
#include "server/telemetry/metrics.h"
#include "server/telemetry/structured_log.h"

namespace polyest {

class Session::Computing {
 public:
  Computing(Session& session, const LoadedSession& loaded) : session_(session), loaded_(loaded) {}
  ~Computing() {
    const std::chrono::duration<double> spent = Clock::now() - begin_;
    if (session_.services_.metrics != nullptr) {
      session_.services_.metrics->CountComputing(spent.count());
    }
    const std::lock_guard lock(session_.mutex_);
    session_.activity_.set_compute_time(session_.activity_.compute_time() + spent.count());
    session_.computed_s_ += spent.count();
    session_.measured_s_ = loaded_.measured_s() - session_.measured_before_s_;
    session_.processed_ = loaded_.sequence();
    session_.last_use_ = Clock::now();
  }
  Computing(const Computing&) = delete;
  Computing& operator=(const Computing&) = delete;

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
      ledger_(head_.place) {
  if (loaded == nullptr) return;
  loaded->SaveSnapshots(services.journal, number());
  Replace({std::move(loaded), 0});
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
  if (activity_.loaded()) {
    activity.set_unprocessed_batches(std::max<int64_t>(0, place.sequence - processed_));
  }
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

Session::InMemory Session::Present() const {
  const std::lock_guard lock(mutex_);
  return in_memory_;
}

// What was in memory before is destroyed after the lock.
void Session::Replace(InMemory in_memory) {
  const std::lock_guard lock(mutex_);
  const bool loaded = in_memory.loaded != nullptr;
  if (loaded) {
    processed_ = in_memory.loaded->sequence();
    measured_before_s_ = in_memory.loaded->measured_s();
  }
  in_memory_.losses = in_memory.losses;
  in_memory_.loaded.swap(in_memory.loaded);
  activity_.set_loaded(loaded);
  measured_s_ = computed_s_ = 0;
}

absl::StatusOr<std::shared_ptr<LoadedSession>> Session::Loaded(const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(CheckOpen());
  const uint64_t losses = ledger_.losses();
  const InMemory present = Present();
  if (present.loaded != nullptr && present.losses == losses) return present.loaded;
  POLYEST_RETURN_IF_ERROR(services_.memory.Check());
  Replace({nullptr, present.losses});
  // Until it is replaced below, no batch is taken.
  POLYEST_ASSIGN_OR_RETURN(
      std::shared_ptr<LoadedSession> loaded,
      LoadedSession::Load(services_.journal, number(), ledger_.kept(), services_.models, stop));
  loaded->SaveSnapshots(services_.journal, number());
  Log(spdlog::level::info, "session loaded", {{"session", name()}, {"tenant", tenant()}});
  passed_on_ = nullptr;
  Replace({loaded, losses});
  return loaded;
}

absl::Status Session::TakeRoom(const SessionPlace& place, const v1::Measurements& batch) const {
  POLYEST_RETURN_IF_ERROR(CheckRows(services_.limits, place, batch));
  if (services_.rows == nullptr) return absl::OkStatus();
  return services_.rows->Take(number(), tenant(), batch.time_size());
}

void Session::ReleaseRoom(int64_t rows) const {
  if (services_.rows != nullptr) services_.rows->Release(number(), rows);
}

absl::StatusOr<v1::Acknowledgement> Session::Add(int64_t sequence, const v1::Measurements& batch) {
  JournalEntry entry;
  entry.session = number();
  entry.measurements = DeterministicBytes(batch);
  entry.digest = Digest(entry.measurements);
  const std::lock_guard taking(taking_);
  POLYEST_RETURN_IF_ERROR(CheckOpen());
  const InMemory present = Present();
  if (present.loaded == nullptr)
    return absl::UnavailableError(name() + " is not loaded; try again");
  BatchIntake& intake = present.loaded->intake();
  POLYEST_ASSIGN_OR_RETURN(const BatchLedger::Kind kind,
                           ledger_.Check(sequence, entry.digest, [this](int64_t kept) {
                             return services_.journal.ReadDigest(number(), kept);
                           }));
  if (kind == BatchLedger::Kind::kNext) {
    const SessionPlace before = intake.place();
    const double measured_s = intake.measured_s();
    POLYEST_RETURN_IF_ERROR(TakeRoom(before, batch));
    absl::Cleanup release_room = [&] { ReleaseRoom(batch.time_size()); };
    POLYEST_RETURN_IF_ERROR(intake.Take(batch, services_.limits.problem));
    entry.place = intake.place();
    POLYEST_RETURN_IF_ERROR(ledger_.Take(entry.place, entry.digest, present.losses));
    const int64_t values = entry.place.samples - before.samples;
    std::move(release_room).Cancel();
    Keep(std::move(entry), present.losses, batch.time_size(), values,
         intake.measured_s() - measured_s);
  }
  v1::Acknowledgement acknowledgement;
  acknowledgement.set_sequence(sequence);
  acknowledgement.set_samples(intake.place().samples);
  return acknowledgement;
}

void Session::Keep(JournalEntry entry, uint64_t losses, int64_t rows, int64_t values,
                   double measured_s) {
  const int64_t sequence = entry.place.sequence;
  services_.journal.Append(
      std::move(entry), [self = shared_from_this(), losses, sequence, rows, values, measured_s,
                         begin = Clock::now()](const absl::Status& kept) {
        const std::chrono::duration<double> duration = Clock::now() - begin;
        if (Metrics* const metrics = self->services_.metrics; metrics != nullptr && kept.ok()) {
          metrics->Count(Metrics::Batch{rows, values, measured_s, duration.count()});
        }
        if (!kept.ok()) self->ReleaseRoom(rows);
        self->ledger_.Settle(losses, sequence, kept);
      });
}

absl::Status Session::Process(const Stop& stop) {
  return ProcessUpTo(std::numeric_limits<int64_t>::max(), stop);
}

absl::Status Session::ProcessUpTo(int64_t sequence, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const auto loaded, Loaded(stop));
  const Computing computing(*this, *loaded);
  return loaded->ProcessUpTo(sequence, stop);
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
    const Computing computing(*this, *loaded);
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
  POLYEST_ASSIGN_OR_RETURN(const auto loaded, Loaded(stop));
  const Computing computing(*this, *loaded);
  return loaded->CurrentPosterior(request, stop);
}

absl::StatusOr<v1::ProfileCostResponse> Session::CurrentProfiles(
    const v1::ProfileCostRequest& request, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const auto loaded, Loaded(stop));
  const Computing computing(*this, *loaded);
  return loaded->CurrentProfiles(request, stop);
}

absl::StatusOr<v1::SweepRegularizationResponse> Session::CurrentRegularizationSweep(
    const v1::SweepRegularizationRequest& request, const Stop& stop) {
  POLYEST_ASSIGN_OR_RETURN(const auto loaded, Loaded(stop));
  const Computing computing(*this, *loaded);
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
  Replace({nullptr, Present().losses});
  passed_on_ = nullptr;
  Log(spdlog::level::info, "session unloaded", {{"session", name()}, {"tenant", tenant()}});
}

}  // namespace polyest
