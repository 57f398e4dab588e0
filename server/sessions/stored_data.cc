#include "server/sessions/stored_data.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <utility>

#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {
namespace {

constexpr int64_t kMebibyte = int64_t{1} << 20;

void Change(StoredAmount& amount, const StoredAmount& by, int64_t sign) {
  amount.rows += sign * by.rows;
  amount.bytes += sign * by.bytes;
}

}  // namespace

absl::Status StoredData::Check(const StoredAmount& of_tenant, const StoredAmount& more) const {
  if (more.rows > 0 && of_tenant.rows + more.rows > limits_.rows_per_tenant) {
    return LimitExceeded(
        "--max-tenant-rows",
        absl::StrFormat("measurements.timeS: %d rows beside the %d that the tenant has stored are "
                        "more than it may have, %d (--max-tenant-rows); delete a session",
                        more.rows, of_tenant.rows, limits_.rows_per_tenant));
  }
  if (more.rows > 0 && in_all_.rows + more.rows > limits_.total_rows) {
    // The message does not tell how many rows the other tenants have.
    return LimitExceeded(
        "--max-total-rows",
        absl::StrFormat(
            "measurements.timeS: %d rows beside all that the daemon has stored are more "
            "than it may have, %d (--max-total-rows); delete a session",
            more.rows, limits_.total_rows));
  }
  const int64_t max_mb = limits_.disk_mb_per_tenant;
  if (max_mb > 0 && of_tenant.bytes + more.bytes > max_mb * kMebibyte) {
    return LimitExceeded(
        "--max-tenant-disk-mb",
        absl::StrFormat("%d bytes beside the %d that the tenant has stored are more than it may "
                        "have, %d MiB (--max-tenant-disk-mb); delete a session",
                        more.bytes, of_tenant.bytes, max_mb));
  }
  return absl::OkStatus();
}

absl::Status StoredData::Take(int64_t session, const std::string& tenant,
                              const StoredAmount& more) {
  const std::lock_guard lock(mutex_);
  active_.insert(tenant);
  const auto found = tenants_.find(tenant);
  const absl::Status room = Check(found == tenants_.end() ? StoredAmount() : found->second, more);
  if (room.ok()) Add(session, tenant, more);
  return room;
}

bool StoredData::TakeSnapshot(int64_t session, const std::string& tenant, int64_t bytes) {
  const std::lock_guard lock(mutex_);
  const auto share = sessions_.find(session);
  // Every session has a problem; this one has been deleted.
  if (share == sessions_.end()) return false;
  const StoredAmount more{0, bytes - share->second.snapshot_bytes};
  if (more.bytes > 0 && !Check(tenants_[tenant], more).ok()) return false;
  Add(session, tenant, more);
  share->second.snapshot_bytes = bytes;
  return true;
}

void StoredData::Count(int64_t session, const std::string& tenant, const StoredAmount& amount,
                       int64_t snapshot_bytes) {
  const std::lock_guard lock(mutex_);
  Add(session, tenant, {amount.rows, amount.bytes + snapshot_bytes});
  if (snapshot_bytes > 0) sessions_[session].snapshot_bytes = snapshot_bytes;
}

void StoredData::Recount(int64_t session, const std::string& tenant, const StoredAmount& amount,
                         int64_t snapshot_bytes) {
  const std::lock_guard lock(mutex_);
  const auto share = sessions_.find(session);
  if (share != sessions_.end()) Remove(share, StoredAmount(share->second.amount));
  Add(session, tenant, {amount.rows, amount.bytes + snapshot_bytes});
  if (snapshot_bytes > 0) sessions_[session].snapshot_bytes = snapshot_bytes;
}

void StoredData::RecountRows(int64_t session, const std::string& tenant, int64_t rows) {
  const std::lock_guard lock(mutex_);
  const auto share = sessions_.find(session);
  const int64_t counted = share == sessions_.end() ? 0 : share->second.amount.rows;
  Add(session, tenant, {rows - counted, 0});
}

void StoredData::NoteActive(const std::string& tenant) {
  const std::lock_guard lock(mutex_);
  active_.insert(tenant);
}

std::set<std::string> StoredData::TakeActive() {
  const std::lock_guard lock(mutex_);
  return std::exchange(active_, {});
}

void StoredData::Release(int64_t session, const StoredAmount& amount) {
  const std::lock_guard lock(mutex_);
  const auto share = sessions_.find(session);
  if (share == sessions_.end()) return;
  const StoredAmount& present = share->second.amount;
  Remove(share, {std::min(amount.rows, present.rows), std::min(amount.bytes, present.bytes)});
}

void StoredData::Forget(int64_t session) {
  const std::lock_guard lock(mutex_);
  const auto share = sessions_.find(session);
  if (share != sessions_.end()) Remove(share, StoredAmount(share->second.amount));
}

StoredAmount StoredData::OfTenant(const std::string& tenant) const {
  const std::lock_guard lock(mutex_);
  const auto found = tenants_.find(tenant);
  return found == tenants_.end() ? StoredAmount() : found->second;
}

StoredAmount StoredData::InAll() const {
  const std::lock_guard lock(mutex_);
  return in_all_;
}

void StoredData::Add(int64_t session, const std::string& tenant, const StoredAmount& amount) {
  if (amount == StoredAmount()) return;
  Share& share = sessions_[session];
  share.tenant = tenant;
  Change(share.amount, amount, 1);
  Change(tenants_[tenant], amount, 1);
  Change(in_all_, amount, 1);
}

void StoredData::Remove(std::map<int64_t, Share>::iterator share, const StoredAmount& amount) {
  const auto tenant = tenants_.find(share->second.tenant);
  Change(in_all_, amount, -1);
  Change(tenant->second, amount, -1);
  Change(share->second.amount, amount, -1);
  if (tenant->second == StoredAmount()) tenants_.erase(tenant);
  if (share->second.amount == StoredAmount()) sessions_.erase(share);
}

}  // namespace polyest::internal
