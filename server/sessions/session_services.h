#pragma once

// What all sessions of a daemon share.

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "core/external/model_library.h"
#include "server/execution/executor.h"
#include "server/journal/session_journal.h"
#include "server/sessions/limits.h"
#include "server/sessions/loaded_session.h"
#include "server/sessions/memory_limit.h"
#include "server/sessions/stored_data.h"
#include "server/sessions/tenant_memory.h"

namespace polyest::internal {

class Metrics;

// Holds references to what all sessions need, which must outlive them.
struct SessionServices {
  Executor& executor;
  SessionJournal& journal;
  const ModelLibrary& models;
  SessionLimits limits = {};
  Metrics* metrics = nullptr;  // null: no metrics are counted
  MemoryLimit memory = MemoryLimit();
  // Counts what is stored; null: it is not counted. The registry sets it.
  std::shared_ptr<StoredData> stored = nullptr;
  // Weighs what is loaded; null: it is not weighed. The registry sets it.
  std::shared_ptr<TenantMemory> tenant_memory = nullptr;

  // Returns how sessions are loaded.
  LoadedSession::Options Loading(LoadedSession::CheckMemory check_memory,
                                 const ProblemLimits& problem_limits = {}) const {
    return {models, problem_limits, std::move(check_memory), executor.threads_per_lane()};
  }
  // Returns what counts the snapshots of a session as stored, if its tenant may store them.
  LoadedSession::TakeSnapshotStorage StorageForSnapshots(int64_t session,
                                                         const std::string& tenant) const {
    return [counted = stored, session, tenant](int64_t bytes) {
      return counted == nullptr || counted->TakeSnapshot(session, tenant, bytes);
    };
  }
};

}  // namespace polyest::internal
