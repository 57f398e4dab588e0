#pragma once

// Counts the rows and the bytes that are stored, for each tenant and in all.

#include <absl/status/status.h>

#include <cstdint>
#include <map>
#include <mutex>
#include <set>
#include <string>

#include "server/sessions/limits.h"

namespace polyest::internal {

// Rows of measurements, and bytes of these, of problems and of snapshots.
struct StoredAmount {
  bool operator==(const StoredAmount&) const = default;

  int64_t rows = 0;
  int64_t bytes = 0;
};

// Thread-safe. Sessions are identified by their number in the journal.
class StoredData {
 public:
  explicit StoredData(const SessionLimits& limits) : limits_(limits) {}

  // Takes room for more. RESOURCE_EXHAUSTED, naming the limit, when there is none.
  absl::Status Take(int64_t session, const std::string& tenant, const StoredAmount& more);
  // Takes room for a snapshot of so many bytes in place of the session's last one. Returns false,
  // and leaves the last one its room, if the tenant has none for it.
  bool TakeSnapshot(int64_t session, const std::string& tenant, int64_t bytes);
  // Counts what is stored already, within the limits or not; the bytes of the snapshot apart.
  void Count(int64_t session, const std::string& tenant, const StoredAmount& amount,
             int64_t snapshot_bytes = 0);
  // Counts anew what another daemon has stored in a session, the bytes of the snapshot apart.
  void Recount(int64_t session, const std::string& tenant, const StoredAmount& amount,
               int64_t snapshot_bytes);
  // Counts the rows of a session anew.
  void RecountRows(int64_t session, const std::string& tenant, int64_t rows);
  // Notes that a tenant uses this daemon, as one does that takes room.
  void NoteActive(const std::string& tenant);
  // Returns the tenants that have been noted since the last call.
  std::set<std::string> TakeActive();
  // Gives back the room of what was taken and then not stored. Does nothing when the session has
  // been forgotten meanwhile.
  void Release(int64_t session, const StoredAmount& amount);
  // Gives back the room of a deleted session.
  void Forget(int64_t session);

  StoredAmount OfTenant(const std::string& tenant) const;
  StoredAmount InAll() const;

 private:
  struct Share {
    std::string tenant;
    StoredAmount amount;
    int64_t snapshot_bytes = 0;  // a part of the amount
  };

  // The following are called with the mutex held.
  absl::Status Check(const StoredAmount& of_tenant, const StoredAmount& more) const;
  void Add(int64_t session, const std::string& tenant, const StoredAmount& amount);
  void Remove(std::map<int64_t, Share>::iterator share, const StoredAmount& amount);

  const SessionLimits limits_;
  mutable std::mutex mutex_;
  // Sessions and tenants that have something stored.
  std::map<int64_t, Share> sessions_;
  std::map<std::string, StoredAmount> tenants_;
  StoredAmount in_all_;
  std::set<std::string> active_;
};

}  // namespace polyest::internal
