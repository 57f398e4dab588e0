#pragma once

// Where sessions are kept.

#include <absl/status/statusor.h>

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "server/sessions/session.h"

namespace polyest {

// From any thread.
class SessionStore {
 public:
  virtual ~SessionStore() = default;

  // id: the last part of the name; empty lets the store choose. INVALID_ARGUMENT for a bad id or
  // problem, ALREADY_EXISTS, RESOURCE_EXHAUSTED past the number of sessions allowed.
  virtual absl::StatusOr<std::shared_ptr<Session>> Create(const std::string& id,
                                                          const v1::Problem& problem) = 0;
  // By full name; NOT_FOUND.
  virtual absl::StatusOr<std::shared_ptr<Session>> Get(const std::string& name) const = 0;
  // At most `count` sessions with names after `after`, in the order of their names.
  virtual std::vector<std::shared_ptr<Session>> List(const std::string& after,
                                                     size_t count) const = 0;
  // Closes it, too; NOT_FOUND.
  virtual absl::Status Delete(const std::string& name) = 0;
};

// Sessions that end with the process.
class MemorySessionStore final : public SessionStore {
 public:
  using Clock = std::function<google::protobuf::Timestamp()>;

  // The executor must outlive the store and its sessions.
  MemorySessionStore(Executor& executor, size_t most_sessions, Clock clock,
                     ModelLibrary models = {});

  absl::StatusOr<std::shared_ptr<Session>> Create(const std::string& id,
                                                  const v1::Problem& problem) override;
  absl::StatusOr<std::shared_ptr<Session>> Get(const std::string& name) const override;
  std::vector<std::shared_ptr<Session>> List(const std::string& after, size_t count) const override;
  absl::Status Delete(const std::string& name) override;

 private:
  // With the mutex held.
  absl::Status CheckFree(const std::string& name) const;
  std::string ChooseName();

  Executor& executor_;
  const size_t most_sessions_;
  const Clock clock_;
  const ModelLibrary models_;
  mutable std::mutex mutex_;
  std::map<std::string, std::shared_ptr<Session>> sessions_;
  int64_t chosen_ = 0;
};

}  // namespace polyest
