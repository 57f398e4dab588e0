#pragma once

// How many rows are stored, of each tenant and in all.

#include <absl/status/status.h>

#include <cstdint>
#include <map>
#include <mutex>
#include <string>

namespace polyest::internal {

// From any thread. Sessions go by their number in the journal.
class StoredRows {
 public:
  StoredRows(int64_t max_per_tenant, int64_t max_in_all)
      : max_per_tenant_(max_per_tenant), max_in_all_(max_in_all) {}

  // Takes room for so many rows more; RESOURCE_EXHAUSTED, naming the limit, where there is none.
  absl::Status Take(int64_t session, const std::string& tenant, int64_t rows);
  // Of rows that are there already, within the limits or not.
  void Count(int64_t session, const std::string& tenant, int64_t rows);
  // Of rows that were taken and then not stored; nothing when the session was forgotten meanwhile.
  void Release(int64_t session, int64_t rows);
  // All rows of a session that is no more.
  void Forget(int64_t session);

  int64_t OfTenant(const std::string& tenant) const;

 private:
  struct Share {
    std::string tenant;
    int64_t rows = 0;
  };

  // With the mutex held.
  void Add(int64_t session, const std::string& tenant, int64_t rows);
  void Remove(std::map<int64_t, Share>::iterator share, int64_t rows);

  const int64_t max_per_tenant_;
  const int64_t max_in_all_;
  mutable std::mutex mutex_;
  // Those that have rows.
  std::map<int64_t, Share> sessions_;
  std::map<std::string, int64_t> tenants_;
  int64_t in_all_ = 0;
};

}  // namespace polyest::internal
