// Brings a session into memory, and takes it out (session.h).

#include <absl/strings/str_format.h>

#include <mutex>
#include <utility>

#include "core/common/status.h"
#include "proto/wire/refusal/refusal.h"
#include "server/execution/guarded.h"
#include "server/sessions/session.h"
#include "server/telemetry/structured_log.h"

namespace polyest::internal {

Session::InMemory Session::Present() const {
  const std::lock_guard lock(mutex_);
  return in_memory_;
}

bool Session::loaded() const {
  const std::lock_guard lock(mutex_);
  return in_memory_.loaded != nullptr;
}

bool Session::ReadyToTake() const {
  const SharedJournal* const shared = services_.journal.shared();
  const InMemory present = Present();
  return CheckOpen().ok() && present.loaded != nullptr && present.losses == ledger_.losses() &&
         (shared == nullptr || shared->Owns(number()));
}

void Session::Weigh() {
  if (services_.tenant_memory == nullptr) return;
  const std::shared_ptr<LoadedSession> loaded = Present().loaded;
  if (loaded == nullptr) return services_.tenant_memory->Forget(number());
  services_.tenant_memory->Set(number(), tenant(), loaded->memory_bytes(), weak_from_this());
}

absl::Status Session::CheckMemory(int64_t bytes) const {
  if (services_.tenant_memory == nullptr) return absl::OkStatus();
  return services_.tenant_memory->MakeRoom(tenant(), bytes);
}

// Exchanges what is in memory. The parameter then holds what was there before, and destroys it
// after the lock is released.
void Session::Replace(InMemory in_memory) {
  if (in_memory.loaded != nullptr) {
    activity_.OnLoaded(in_memory.loaded->sequence(), in_memory.loaded->measured_s());
  } else {
    activity_.OnUnloaded();
  }
  const std::lock_guard lock(mutex_);
  std::swap(in_memory_, in_memory);
}

absl::StatusOr<std::shared_ptr<LoadedSession>> Session::Loaded(const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(CheckOpen());
  POLYEST_RETURN_IF_ERROR(Own());
  const uint64_t losses = ledger_.losses();
  const InMemory present = Present();
  if (present.loaded != nullptr && present.losses == losses) {
    if (present.loaded->in_doubt()) {
      POLYEST_RETURN_IF_ERROR(AwaitKept(*present.loaded, stop));
      POLYEST_RETURN_IF_ERROR(present.loaded->Renew(stop));
    }
    present.loaded->Release(ledger_.kept().sequence);
    return present.loaded;
  }
  POLYEST_RETURN_IF_ERROR(services_.memory.Check());
  Replace({nullptr, present.losses});
  Weigh();
  // No batch is taken until the session is loaded again below.
  const auto check_memory = [this](int64_t bytes) { return CheckMemory(bytes); };
  POLYEST_ASSIGN_OR_RETURN(std::shared_ptr<LoadedSession> loaded,
                           LoadedSession::Load(services_.journal, head_, ledger_.kept(),
                                               services_.Loading(check_memory), stop));
  loaded->Attach(services_.journal, number(), services_.StorageForSnapshots(number(), tenant()));
  Log(spdlog::level::info, "session loaded", {{"session", name()}, {"tenant", tenant()}});
  published_ = nullptr;
  history_.reset();
  Replace({loaded, losses});
  Weigh();
  return loaded;
}

absl::Status Session::Own() {
  SharedJournal* const shared = services_.journal.shared();
  if (shared == nullptr) return absl::OkStatus();
  if (ReadyToTake()) return absl::OkStatus();
  // The claim settles a batch that is just being taken. The next waits for what the claim changes.
  const std::lock_guard taking(taking_);
  const absl::StatusOr<SessionPlace> place = shared->Claim(number());
  if (!place.ok()) {
    const std::optional<Refusal> refusal = RefusalOf(place.status());
    if (refusal && refusal->reason == kOwnedElsewhere) Drop();
    return place.status();
  }
  const SessionPlace kept = ledger_.kept();
  if (place->sequence < kept.sequence) {
    return absl::DataLossError(
        absl::StrFormat("batches %d to %d of the session were acknowledged and are missing in the "
                        "journal",
                        place->sequence + 1, kept.sequence));
  }
  if (place->sequence == kept.sequence && ledger_.all_kept()) return absl::OkStatus();
  Drop();
  if (services_.stored != nullptr) {
    services_.stored->RecountRows(number(), tenant(), place->rows);
  }
  ledger_.Restart(*place);
  return absl::OkStatus();
}

void Session::Follow(const SessionPlace& place) {
  SharedJournal* const shared = services_.journal.shared();
  if (shared == nullptr || shared->Owns(number())) return;
  // An estimator that is still in memory, because this daemon was the owner once, lacks batches.
  ledger_.Follow(place, loaded());
}

// Takes what is computed out of memory.
void Session::Drop() {
  Replace({nullptr, Present().losses});
  Weigh();
  published_ = nullptr;
  history_.reset();
}

void Session::Unload(Clock::duration idle) {
  // If memory lacks for this, what the session still holds leaves the next time.
  Guarded([&] {
    UnloadIfIdle(idle);
    return absl::OkStatus();
  }).IgnoreError();
}

void Session::UnloadIfIdle(Clock::duration at_least) {
  // A writer that claims the session does so before this lock, and it stays in memory, or sees that
  // it is gone.
  std::unique_lock lock(mutex_);
  const bool idle = IdleTime() >= at_least;  // nothing is less than any time
  const auto dropped = idle ? std::move(in_memory_.loaded) : nullptr;
  lock.unlock();
  if (!idle) return Weigh();
  Drop();
  if (SharedJournal* const shared = services_.journal.shared()) shared->Release(number());
  Log(spdlog::level::info, "session unloaded", {{"session", name()}, {"tenant", tenant()}});
}

}  // namespace polyest::internal
