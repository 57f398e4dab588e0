#pragma once

// Keeps the sessions of all tenants, by tenant and name.

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

// Thread-safe. A session of another tenant is NOT_FOUND.
class SessionRegistry {
 public:
  using WallClock = std::function<google::protobuf::Timestamp()>;

  // Makes a registry with the sessions that the journal has; their estimators stay on disk until
  // they are used.
  static absl::StatusOr<std::unique_ptr<SessionRegistry>> Open(const SessionServices& services,
                                                               WallClock clock);

  // Creates a session. `id` is the last part of its name; empty lets the registry choose.
  // `reorder_window_s` is that of v1::Session. INVALID_ARGUMENT for a bad id, problem or window,
  // ALREADY_EXISTS when the name is taken, RESOURCE_EXHAUSTED past a limit; on a stop request its
  // status. Waits for the journal.
  absl::StatusOr<std::shared_ptr<Session>> Create(const std::string& tenant, const std::string& id,
                                                  const v1::Problem& problem,
                                                  double reorder_window_s = 0,
                                                  const Stop& stop = {});
  // Returns the session of this full name; NOT_FOUND when there is none that this daemon knows.
  absl::StatusOr<std::shared_ptr<Session>> Get(const std::string& tenant,
                                               const std::string& name) const;
  // Returns the session of this full name, whichever daemon has it: where several share a journal,
  // looks it up there, and waits for that. NOT_FOUND when there is none; UNAVAILABLE, naming the
  // owner, when it belongs to another daemon that lives.
  absl::StatusOr<std::shared_ptr<Session>> Find(const std::string& tenant, const std::string& name);
  // Returns at most `count` sessions with names after `after`, in the order of their names.
  // Waits for the journal if several daemons share it.
  absl::StatusOr<std::vector<std::shared_ptr<Session>>> List(const std::string& tenant,
                                                             const std::string& after,
                                                             size_t count);
  // Returns whether several daemons share the journal, so that sessions are to be looked for with
  // Find, where a thread may wait.
  bool shared() const { return services_.journal.shared() != nullptr; }
  // Deletes a session and closes it; NOT_FOUND when there is none. Waits for the journal.
  absl::Status Delete(const std::string& tenant, const std::string& name);

  // The following two are for SessionImport. CheckMayCreate refuses a name that is taken, and any
  // name when a limit is reached. Adopt adds a session that the journal keeps; RESOURCE_EXHAUSTED,
  // with the session deleted, when others have come first and a limit of sessions is reached.
  absl::Status CheckMayCreate(const std::string& tenant, const std::string& name) const;
  absl::StatusOr<std::shared_ptr<Session>> Adopt(SessionHead head,
                                                 std::unique_ptr<LoadedSession> loaded);

  // Brings what is known of the tenants that have used this daemon since the last call up to date
  // with the journal that it shares, so that their limits hold over all daemons. Waits for the
  // journal; what it does not tell stays as it was. Ends early when the journal does not answer, or
  // on a stop request.
  void FollowOthers(std::stop_token stop = {});

  // Returns the sessions of all tenants.
  std::vector<std::shared_ptr<Session>> All() const;

  const SessionServices& services() const { return services_; }

 private:
  using Key = std::pair<std::string, std::string>;  // tenant, name

  SessionRegistry(const SessionServices& services, WallClock clock);
  absl::Status FollowOthers(SharedJournal& shared, const std::string& tenant);
  // Returns the session whose head the shared journal has told.
  std::shared_ptr<Session> Follow(SessionHead head);
  // Forgets a session that another daemon has deleted.
  void Forget(const Key& key);
  // Puts a new session into the journal, which sets its number, and takes room for its problem.
  // With `choose_name`, gives the session another name where its own is taken.
  absl::Status Store(const v1::Problem& problem, bool choose_name, SessionHead& head);
  // Adds a session, unless it has been added already; returns the one that is there.
  absl::StatusOr<std::shared_ptr<Session>> Add(const Key& key, std::shared_ptr<Session> session);
  // The following are called with the mutex held.
  absl::Status CheckFree(const Key& key) const;
  absl::Status CheckCount(const std::string& tenant) const;
  std::string ChooseName(const std::string& tenant);

  SessionServices services_;
  const WallClock clock_;
  mutable std::mutex mutex_;
  std::map<Key, std::shared_ptr<Session>> sessions_;
  std::map<std::string, int64_t> count_;  // number of sessions, by tenant
  int64_t chosen_ = 0;
};

// Refuses with INVALID_ARGUMENT an id that a session cannot have.
absl::Status CheckSessionId(const std::string& id);

}  // namespace polyest::internal
