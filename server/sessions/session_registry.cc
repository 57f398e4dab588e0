#include "server/sessions/session_registry.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <utility>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "proto/wire/refusal/refusal.h"
#include "server/digest/digest.h"

namespace polyest::internal {
namespace {

constexpr size_t kLongestId = 63;
// Number of heads that one question to a shared journal asks for.
constexpr int64_t kFollowedAtOnce = 500;

absl::Status NotFound(const std::string& name) {
  return absl::NotFoundError(absl::StrFormat("there is no session \"%s\"", name));
}

}  // namespace

absl::Status CheckSessionId(const std::string& id) {
  const bool good = !id.empty() && id.size() <= kLongestId && absl::ascii_islower(id.front()) &&
                    std::all_of(id.begin(), id.end(), [](unsigned char c) {
                      return absl::ascii_islower(c) || absl::ascii_isdigit(c) || c == '-';
                    });
  if (good) return absl::OkStatus();
  return InvalidField(
      "sessionId",
      absl::StrFormat("\"%s\" must be 1 to %d of a-z, 0-9 and -, first a letter", id, kLongestId));
}

SessionRegistry::SessionRegistry(const SessionServices& services, WallClock clock)
    : services_(services), clock_(std::move(clock)) {
  services_.stored = std::make_shared<StoredData>(services.limits);
  services_.tenant_memory = std::make_shared<TenantMemory>(services.limits.memory_mb_per_tenant);
}

absl::StatusOr<std::unique_ptr<SessionRegistry>> SessionRegistry::Open(
    const SessionServices& services, WallClock clock) {
  POLYEST_ASSIGN_OR_RETURN(std::vector<SessionHead> heads, services.journal.Heads());
  std::unique_ptr<SessionRegistry> registry(new SessionRegistry(services, std::move(clock)));
  for (SessionHead& head : heads) {
    ++registry->count_[head.tenant];
    registry->services_.stored->Count(head.number, head.tenant, {head.place.rows, head.bytes},
                                      head.snapshot_bytes);
    const Key key(head.tenant, head.name);
    registry->sessions_.emplace(key,
                                std::make_shared<Session>(registry->services_, std::move(head)));
  }
  return registry;
}

absl::StatusOr<std::shared_ptr<Session>> SessionRegistry::Create(const std::string& tenant,
                                                                 const std::string& id,
                                                                 const v1::Problem& problem,
                                                                 double reorder_window_s,
                                                                 const Stop& stop) {
  if (!id.empty()) POLYEST_RETURN_IF_ERROR(CheckSessionId(id));
  POLYEST_RETURN_IF_ERROR(CheckReorderWindow({"session", "reorderWindowS"}, reorder_window_s));
  SessionHead head;
  head.reorder_window_s = reorder_window_s;
  head.tenant = tenant;
  {
    const std::lock_guard lock(mutex_);
    head.name = id.empty() ? ChooseName(tenant) : absl::StrCat("sessions/", id);
    POLYEST_RETURN_IF_ERROR(CheckFree({tenant, head.name}));
  }
  // The mutex is not held here, because a large problem takes its time, and so does the journal.
  // The journal checks again whether the name is free.
  const auto make_room = [&](int64_t bytes) {
    return services_.tenant_memory->MakeRoom(tenant, bytes);
  };
  POLYEST_ASSIGN_OR_RETURN(
      auto loaded,
      LoadedSession::Make(problem, reorder_window_s,
                          services_.Loading(make_room, services_.limits.problem), stop));
  head.create_time = clock_();
  // The address of the schema is for editors, and may be of any length.
  v1::Problem kept = problem;
  kept.clear_schema();
  POLYEST_RETURN_IF_ERROR(Store(kept, /*choose_name=*/id.empty(), head));
  return Adopt(std::move(head), std::move(loaded));
}

absl::Status SessionRegistry::Store(const v1::Problem& problem, bool choose_name,
                                    SessionHead& head) {
  auto number = services_.journal.Create(head, problem, /*hidden=*/false);
  // Another daemon may have chosen the same name.
  while (choose_name && absl::IsAlreadyExists(number.status())) {
    {
      const std::lock_guard lock(mutex_);
      head.name = ChooseName(head.tenant);
    }
    number = services_.journal.Create(head, problem, /*hidden=*/false);
  }
  if (absl::IsAlreadyExists(number.status())) {
    return absl::AlreadyExistsError(
        absl::StrFormat("there is a session \"%s\" already", head.name));
  }
  POLYEST_RETURN_IF_ERROR(number.status());
  head.number = *number;
  const auto bytes = static_cast<int64_t>(DeterministicBytes(problem).size());
  const absl::Status room = services_.stored->Take(head.number, head.tenant, {0, bytes});
  if (!room.ok()) services_.journal.Delete(head.number).IgnoreError();
  return room;
}

absl::StatusOr<std::shared_ptr<Session>> SessionRegistry::Adopt(
    SessionHead head, std::unique_ptr<LoadedSession> loaded) {
  const Key key(head.tenant, head.name);
  auto session = std::make_shared<Session>(services_, std::move(head), std::move(loaded));
  session->Weigh();
  auto added = Add(key, session);
  if (added.ok()) return added;
  services_.journal.Delete(session->number()).IgnoreError();
  services_.stored->Forget(session->number());
  return added;
}

absl::StatusOr<std::shared_ptr<Session>> SessionRegistry::Add(const Key& key,
                                                              std::shared_ptr<Session> session) {
  const std::lock_guard lock(mutex_);
  // Somebody may have found it in a shared journal.
  const auto there = sessions_.find(key);
  if (there != sessions_.end() && there->second->number() == session->number()) {
    return there->second;
  }
  // The journal has no two sessions of a name, so one that is still here is just being deleted. The
  // new one takes its place.
  if (there == sessions_.end()) {
    POLYEST_RETURN_IF_ERROR(CheckCount(key.first));
    ++count_[key.first];
  }
  return sessions_[key] = std::move(session);
}

absl::Status SessionRegistry::CheckMayCreate(const std::string& tenant,
                                             const std::string& name) const {
  const std::lock_guard lock(mutex_);
  return CheckFree({tenant, name});
}

absl::Status SessionRegistry::CheckFree(const Key& key) const {
  // A session that is known here may have been deleted by another daemon: the journal tells.
  if (!shared() && sessions_.contains(key)) {
    return absl::AlreadyExistsError(
        absl::StrFormat("there is a session \"%s\" already", key.second));
  }
  POLYEST_RETURN_IF_ERROR(CheckCount(key.first));
  return services_.memory.Check();
}

absl::Status SessionRegistry::CheckCount(const std::string& tenant) const {
  services_.stored->NoteActive(tenant);
  if (static_cast<int64_t>(sessions_.size()) >= services_.limits.sessions) {
    return LimitExceeded(
        "--max-sessions",
        absl::StrFormat("the daemon keeps at most %d sessions (--max-sessions); delete one",
                        services_.limits.sessions));
  }
  const auto count = count_.find(tenant);
  if (count != count_.end() && count->second >= services_.limits.sessions_per_tenant) {
    return LimitExceeded(
        "--max-sessions-per-tenant",
        absl::StrFormat("a tenant may have at most %d sessions (--max-sessions-per-tenant); delete "
                        "one",
                        services_.limits.sessions_per_tenant));
  }
  return absl::OkStatus();
}

std::string SessionRegistry::ChooseName(const std::string& tenant) {
  std::string name;
  do {
    name = absl::StrCat("sessions/session-", ++chosen_);
  } while (sessions_.contains({tenant, name}));
  return name;
}

absl::StatusOr<std::shared_ptr<Session>> SessionRegistry::Get(const std::string& tenant,
                                                              const std::string& name) const {
  const std::lock_guard lock(mutex_);
  const auto found = sessions_.find({tenant, name});
  if (found == sessions_.end()) return NotFound(name);
  return found->second;
}

absl::StatusOr<std::shared_ptr<Session>> SessionRegistry::Find(const std::string& tenant,
                                                               const std::string& name) {
  SharedJournal* const shared = services_.journal.shared();
  auto known = Get(tenant, name);
  if (shared == nullptr) return known;
  if (known.ok() && (*known)->loaded() && shared->Owns((*known)->number())) return known;
  POLYEST_ASSIGN_OR_RETURN(std::optional<SessionHead> head, shared->HeadOf(tenant, name));
  if (head) return Follow(*std::move(head));
  Forget({tenant, name});
  return NotFound(name);
}

std::shared_ptr<Session> SessionRegistry::Follow(SessionHead head) {
  const Key key(head.tenant, head.name);
  std::shared_ptr<Session> before, followed;
  {
    const std::lock_guard lock(mutex_);
    std::shared_ptr<Session>& session = sessions_[key];
    // What this daemon stores itself it has counted.
    if (!services_.journal.shared()->Owns(head.number)) {
      services_.stored->Recount(head.number, head.tenant, {head.place.rows, head.bytes},
                                head.snapshot_bytes);
    }
    if (session != nullptr && session->number() == head.number) {
      session->Follow(head.place);
      return session;
    }
    if (session == nullptr) ++count_[key.first];
    before = std::exchange(session, nullptr);
    session = followed = std::make_shared<Session>(services_, std::move(head));
  }
  if (before != nullptr) {
    services_.stored->Forget(before->number());
    before->Close();
  }
  return followed;
}

void SessionRegistry::Forget(const Key& key) {
  std::shared_ptr<Session> forgotten;
  {
    const std::lock_guard lock(mutex_);
    const auto found = sessions_.find(key);
    if (found == sessions_.end()) return;
    forgotten = std::move(found->second);
    sessions_.erase(found);
    --count_[key.first];
  }
  services_.stored->Forget(forgotten->number());
  forgotten->Close();
}

void SessionRegistry::FollowOthers(std::stop_token stop) {
  SharedJournal* const shared = services_.journal.shared();
  if (shared == nullptr) return;
  absl::Status answered;
  for (const std::string& tenant : services_.stored->TakeActive()) {
    if (answered.ok() && !stop.stop_requested()) answered = FollowOthers(*shared, tenant);
    if (!answered.ok()) services_.stored->NoteActive(tenant);
  }
}

absl::Status SessionRegistry::FollowOthers(SharedJournal& shared, const std::string& tenant) {
  // Sessions that are known before the journal is asked, and that it does not name, are deleted.
  std::map<int64_t, std::string> gone;
  {
    const std::lock_guard lock(mutex_);
    for (auto it = sessions_.lower_bound({tenant, ""});
         it != sessions_.end() && it->first.first == tenant; ++it) {
      gone[it->second->number()] = it->first.second;
    }
  }
  std::string after;
  while (true) {
    POLYEST_ASSIGN_OR_RETURN(std::vector<SessionHead> heads,
                             shared.HeadsAfter(tenant, after, kFollowedAtOnce));
    const bool last = std::ssize(heads) < kFollowedAtOnce;
    for (SessionHead& head : heads) {
      after = head.name;
      gone.erase(head.number);
      Follow(std::move(head));
    }
    if (last) break;
  }
  for (const auto& [number, name] : gone) {
    const auto session = Get(tenant, name);
    if (session.ok() && (*session)->number() == number) Forget({tenant, name});
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<std::shared_ptr<Session>>> SessionRegistry::List(
    const std::string& tenant, const std::string& after, size_t count) {
  std::vector<std::shared_ptr<Session>> page;
  if (SharedJournal* const shared = services_.journal.shared()) {
    POLYEST_ASSIGN_OR_RETURN(std::vector<SessionHead> heads,
                             shared->HeadsAfter(tenant, after, static_cast<int64_t>(count)));
    for (SessionHead& head : heads) page.push_back(Follow(std::move(head)));
    return page;
  }
  const std::lock_guard lock(mutex_);
  for (auto it = sessions_.upper_bound({tenant, after});
       it != sessions_.end() && it->first.first == tenant && page.size() < count; ++it) {
    page.push_back(it->second);
  }
  return page;
}

absl::Status SessionRegistry::Delete(const std::string& tenant, const std::string& name) {
  POLYEST_ASSIGN_OR_RETURN(const std::shared_ptr<Session> session, Find(tenant, name));
  // The journal comes first, so that a session that cannot be deleted goes on as it was.
  const absl::Status deleted = services_.journal.Delete(session->number());
  if (absl::IsNotFound(deleted)) return NotFound(name);
  POLYEST_RETURN_IF_ERROR(deleted);
  {
    const std::lock_guard lock(mutex_);
    // A new session may have the name by now, which the journal has had free since.
    const auto found = sessions_.find({tenant, name});
    if (found != sessions_.end() && found->second == session) {
      sessions_.erase(found);
      --count_[tenant];
    }
  }
  services_.stored->Forget(session->number());
  session->Close();
  // A list that was read just before the deletion may add it again; the next look removes it.
  services_.stored->NoteActive(tenant);
  return absl::OkStatus();
}

std::vector<std::shared_ptr<Session>> SessionRegistry::All() const {
  std::vector<std::shared_ptr<Session>> all;
  const std::lock_guard lock(mutex_);
  all.reserve(sessions_.size());
  for (const auto& [key, session] : sessions_) all.push_back(session);
  return all;
}

}  // namespace polyest::internal
