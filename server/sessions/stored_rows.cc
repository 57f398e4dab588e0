#include "server/sessions/stored_rows.h"

#include <absl/strings/str_format.h>

#include <algorithm>

#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {

absl::Status StoredRows::Take(int64_t session, const std::string& tenant, int64_t rows) {
  const std::lock_guard lock(mutex_);
  const auto found = tenants_.find(tenant);
  const int64_t present = found == tenants_.end() ? 0 : found->second;
  if (present + rows > max_per_tenant_) {
    return LimitExceeded(
        "--max-tenant-rows",
        absl::StrFormat("measurements.timeS: %d rows beside the %d that the tenant has stored are "
                        "more than it may have, %d (--max-tenant-rows); delete a session",
                        rows, present, max_per_tenant_));
  }
  if (in_all_ + rows > max_in_all_) {
    // The message does not tell how many rows the other tenants have.
    return LimitExceeded(
        "--max-total-rows",
        absl::StrFormat(
            "measurements.timeS: %d rows beside all that the daemon has stored are more "
            "than it may have, %d (--max-total-rows); delete a session",
            rows, max_in_all_));
  }
  Add(session, tenant, rows);
  return absl::OkStatus();
}

void StoredRows::Count(int64_t session, const std::string& tenant, int64_t rows) {
  const std::lock_guard lock(mutex_);
  Add(session, tenant, rows);
}

void StoredRows::Release(int64_t session, int64_t rows) {
  const std::lock_guard lock(mutex_);
  const auto share = sessions_.find(session);
  if (share != sessions_.end()) Remove(share, std::min(rows, share->second.rows));
}

void StoredRows::Forget(int64_t session) {
  const std::lock_guard lock(mutex_);
  const auto share = sessions_.find(session);
  if (share != sessions_.end()) Remove(share, share->second.rows);
}

int64_t StoredRows::OfTenant(const std::string& tenant) const {
  const std::lock_guard lock(mutex_);
  const auto found = tenants_.find(tenant);
  return found == tenants_.end() ? 0 : found->second;
}

void StoredRows::Add(int64_t session, const std::string& tenant, int64_t rows) {
  if (rows == 0) return;
  Share& share = sessions_[session];
  share.tenant = tenant;
  share.rows += rows;
  tenants_[tenant] += rows;
  in_all_ += rows;
}

void StoredRows::Remove(std::map<int64_t, Share>::iterator share, int64_t rows) {
  const auto tenant = tenants_.find(share->second.tenant);
  in_all_ -= rows;
  if ((tenant->second -= rows) == 0) tenants_.erase(tenant);
  if ((share->second.rows -= rows) == 0) sessions_.erase(share);
}

}  // namespace polyest::internal
