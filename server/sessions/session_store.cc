#include "server/sessions/session_store.h"

#include <absl/strings/ascii.h>
#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>

#include <algorithm>
#include <utility>

#include "core/common/status.h"

namespace polyest {
namespace {

constexpr size_t kLongestId = 63;

absl::Status CheckId(const std::string& id) {
  const bool good = id.size() <= kLongestId && absl::ascii_islower(id.front()) &&
                    std::all_of(id.begin(), id.end(), [](unsigned char c) {
                      return absl::ascii_islower(c) || absl::ascii_isdigit(c) || c == '-';
                    });
  if (good) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrFormat(
      "sessionId: \"%s\" must be 1 to %d of a-z, 0-9 and -, first a letter", id, kLongestId));
}

absl::Status NotFound(const std::string& name) {
  return absl::NotFoundError(absl::StrFormat("there is no session \"%s\"", name));
}

}  // namespace

MemorySessionStore::MemorySessionStore(Executor& executor, size_t most_sessions, Clock clock,
                                       ModelLibrary models)
    : executor_(executor),
      most_sessions_(most_sessions),
      clock_(std::move(clock)),
      models_(std::move(models)) {}

absl::StatusOr<std::shared_ptr<Session>> MemorySessionStore::Create(const std::string& id,
                                                                    const v1::Problem& problem) {
  std::string name;
  if (!id.empty()) POLYEST_RETURN_IF_ERROR(CheckId(id));
  {
    std::lock_guard lock(mutex_);
    name = id.empty() ? ChooseName() : absl::StrCat("sessions/", id);
    POLYEST_RETURN_IF_ERROR(CheckFree(name));
  }
  // Not under the mutex: a large problem takes its time. So look again before it goes in.
  POLYEST_ASSIGN_OR_RETURN(auto session,
                           Session::Make(name, problem, clock_(), executor_, models_));
  std::lock_guard lock(mutex_);
  POLYEST_RETURN_IF_ERROR(CheckFree(name));
  sessions_.emplace(name, session);
  return session;
}

absl::Status MemorySessionStore::CheckFree(const std::string& name) const {
  if (sessions_.contains(name)) {
    return absl::AlreadyExistsError(absl::StrFormat("there is a session \"%s\" already", name));
  }
  if (sessions_.size() >= most_sessions_) {
    return absl::ResourceExhaustedError(
        absl::StrFormat("the daemon keeps at most %d sessions; delete one", most_sessions_));
  }
  return absl::OkStatus();
}

std::string MemorySessionStore::ChooseName() {
  std::string name;
  do {
    name = absl::StrCat("sessions/session-", ++chosen_);
  } while (sessions_.contains(name));
  return name;
}

absl::StatusOr<std::shared_ptr<Session>> MemorySessionStore::Get(const std::string& name) const {
  std::lock_guard lock(mutex_);
  const auto found = sessions_.find(name);
  if (found == sessions_.end()) return NotFound(name);
  return found->second;
}

std::vector<std::shared_ptr<Session>> MemorySessionStore::List(const std::string& after,
                                                               size_t count) const {
  std::vector<std::shared_ptr<Session>> page;
  std::lock_guard lock(mutex_);
  for (auto it = sessions_.upper_bound(after); it != sessions_.end() && page.size() < count; ++it) {
    page.push_back(it->second);
  }
  return page;
}

absl::Status MemorySessionStore::Delete(const std::string& name) {
  std::shared_ptr<Session> session;
  {
    std::lock_guard lock(mutex_);
    const auto found = sessions_.find(name);
    if (found == sessions_.end()) return NotFound(name);
    session = std::move(found->second);
    sessions_.erase(found);
  }
  session->Close();
  return absl::OkStatus();
}

}  // namespace polyest
