#pragma once

// Shares the memory of loaded sessions out by tenant. Each loaded session is weighed when it is
// loaded and after each computation. Past its limit a tenant's own idle sessions leave the memory,
// those first that have been idle longest; if that is not enough, its new work is refused. Other
// tenants notice nothing.

#include <absl/status/status.h>

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace polyest::internal {

class Session;

// Thread-safe. Sessions are identified by their number in the journal.
class TenantMemory {
 public:
  // `max_mb` is the limit of each tenant in MiB (--max-tenant-memory-mb); 0: no limit.
  explicit TenantMemory(int64_t max_mb) : max_mb_(max_mb) {}

  // Sets what a session holds, of which only one that is given here can leave the memory.
  void Set(int64_t session, const std::string& tenant, int64_t bytes,
           std::weak_ptr<Session> leaves = {});
  // Adds to what a session holds; does nothing if it is not loaded.
  void Add(int64_t session, int64_t bytes);
  // Forgets a session that has left the memory.
  void Forget(int64_t session);

  // Lets idle sessions of the tenant leave the memory, soon, as far as it needs to hold so many
  // bytes more. RESOURCE_EXHAUSTED if that is not enough; trying again later may help unless the
  // bytes alone are beyond the limit.
  absl::Status MakeRoom(const std::string& tenant, int64_t more);

  int64_t OfTenant(const std::string& tenant) const;

 private:
  struct Share {
    std::string tenant;
    int64_t bytes = 0;
    bool leaving = false;
    std::weak_ptr<Session> session;
  };

  // Returns the sessions that may leave; subtracts what those that are leaving hold from `excess`.
  std::vector<std::pair<int64_t, std::shared_ptr<Session>>> Candidates(const std::string& tenant,
                                                                       int64_t& excess);
  void NoteLeaving(int64_t session, bool leaving);
  // Gives the memory of sessions that have left back to the operating system, once they have held
  // half of what a tenant may.
  void Trim();

  const int64_t max_mb_;
  mutable std::mutex mutex_;
  std::map<int64_t, Share> sessions_;       // those that are loaded
  std::map<std::string, int64_t> tenants_;  // those that have any; bytes
  int64_t left_bytes_ = 0;                  // held by sessions that have left since the last Trim
};

}  // namespace polyest::internal
