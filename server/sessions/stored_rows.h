#pragma once

// Counts the rows that are stored, for each tenant and in all.

#include <absl/status/status.h>

#include <cstdint>
#include <map>
#include <mutex>
#include <string>

namespace polyest::internal {

// Thread-safe. Sessions are identified by their number in the journal.
class StoredRows {
 public:
  StoredRows(int64_t max_per_tenant, int64_t max_in_all)
      : max_per_tenant_(max_per_tenant), max_in_all_(max_in_all) {}

  // Takes room for `rows` more rows. RESOURCE_EXHAUSTED, naming the limit, when there is none.
  absl::Status Take(int64_t session, const std::string& tenant, int64_t rows);
  // Counts rows that are stored already, within the limits or not.
  void Count(int64_t session, const std::string& tenant, int64_t rows);
  // Gives back the room of rows that were taken and then not stored. Does nothing when the session
  // has been forgotten meanwhile.
  void Release(int64_t session, int64_t rows);
  // Gives back the room of all rows of a deleted session.
  void Forget(int64_t session);

  // Returns the number of rows of a tenant.
  int64_t OfTenant(const std::string& tenant) const;

 private:
  struct Share {
    std::string tenant;
    int64_t rows = 0;
  };

  // The following are called with the mutex held.
  void Add(int64_t session, const std::string& tenant, int64_t rows);
  void Remove(std::map<int64_t, Share>::iterator share, int64_t rows);

  const int64_t max_per_tenant_;
  const int64_t max_in_all_;
  mutable std::mutex mutex_;
  // Sessions and tenants that have rows.
  std::map<int64_t, Share> sessions_;
  std::map<std::string, int64_t> tenants_;
  int64_t in_all_ = 0;
};

}  // namespace polyest::internal
