#pragma once

// The sessions there are, by tenant and name.

#include <absl/status/statusor.h>

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "server/sessions/session.h"

namespace polyest::internal {

// From any thread. A session of another tenant is NOT_FOUND.
class SessionRegistry {
 public:
  using WallClock = std::function<google::protobuf::Timestamp()>;

  // With the sessions that the journal has; their estimators stay on disk until they are used.
  static absl::StatusOr<std::unique_ptr<SessionRegistry>> Open(const SessionServices& services,
                                                               WallClock clock);

  // id: the last part of the name; empty lets the registry choose. INVALID_ARGUMENT for a bad id or
  // problem, ALREADY_EXISTS, RESOURCE_EXHAUSTED past a limit. Waits for the journal.
  absl::StatusOr<std::shared_ptr<Session>> Create(const std::string& tenant, const std::string& id,
                                                  const v1::Problem& problem);
  // By full name; NOT_FOUND.
  absl::StatusOr<std::shared_ptr<Session>> Get(const std::string& tenant,
                                               const std::string& name) const;
  // At most `count` sessions with names after `after`, in the order of their names.
  std::vector<std::shared_ptr<Session>> List(const std::string& tenant, const std::string& after,
                                             size_t count) const;
  // Closes it, too; NOT_FOUND. Waits for the journal.
  absl::Status Delete(const std::string& tenant, const std::string& name);

  // For SessionImport: whether there is room for one of that name; and one that the journal keeps.
  absl::Status CheckRoom(const std::string& tenant, const std::string& name) const;
  absl::StatusOr<std::shared_ptr<Session>> Adopt(SessionHead head,
                                                 std::unique_ptr<LoadedSession> loaded);

  // Of all tenants.
  std::vector<std::shared_ptr<Session>> All() const;

  const SessionServices& services() const { return services_; }

 private:
  using Key = std::pair<std::string, std::string>;  // tenant, name

  SessionRegistry(const SessionServices& services, WallClock clock);
  // With the mutex held.
  absl::Status CheckFree(const Key& key) const;
  std::string ChooseName(const std::string& tenant);

  SessionServices services_;
  const WallClock clock_;
  mutable std::mutex mutex_;
  std::map<Key, std::shared_ptr<Session>> sessions_;
  std::map<std::string, int64_t> count_;  // by tenant
  int64_t chosen_ = 0;
};

// INVALID_ARGUMENT for an id that a session cannot have.
absl::Status CheckSessionId(const std::string& id);

}  // namespace polyest::internal
