#include "server/sessions/tenant_memory.h"

#include <absl/strings/str_format.h>
#include <malloc.h>

#include <algorithm>
#include <chrono>
#include <functional>
#include <tuple>

#include "proto/wire/refusal/refusal.h"
#include "server/sessions/session.h"

namespace polyest::internal {
namespace {

constexpr int64_t kBytesOfMebibyte = int64_t{1} << 20;
// Time in which idle sessions leave the memory.
constexpr std::chrono::seconds kTimeToLeave{2};

// Returns the size in MiB, rounded up.
int64_t Mebibytes(int64_t bytes) { return (bytes + kBytesOfMebibyte - 1) / kBytesOfMebibyte; }

absl::Status TooLarge(int64_t bytes, int64_t max_mb) {
  return LimitExceeded(
      "--max-tenant-memory-mb",
      absl::StrFormat("about %d MiB of memory are needed, more than all loaded sessions of a "
                      "tenant may hold, %d MiB (--max-tenant-memory-mb); a lower order, fewer "
                      "points per term or fewer rows need less",
                      Mebibytes(bytes), max_mb));
}

absl::Status NoRoom(int64_t held, int64_t more, int64_t max_mb) {
  return Refuse(
      absl::StatusCode::kResourceExhausted,
      absl::StrFormat("%d MiB beside the %d MiB that the tenant's sessions in use hold "
                      "are more memory than a tenant may have, %d MiB "
                      "(--max-tenant-memory-mb); end other streams, or try later",
                      Mebibytes(more), Mebibytes(held), max_mb),
      {.reason = kOutOfMemory, .limit = "--max-tenant-memory-mb", .retry_delay = kTimeToLeave});
}

}  // namespace

void TenantMemory::Set(int64_t session, const std::string& tenant, int64_t bytes,
                       std::weak_ptr<Session> leaves) {
  const std::lock_guard lock(mutex_);
  Share& share = sessions_[session];
  tenants_[tenant] += bytes - share.bytes;
  share = {tenant, bytes, /*leaving=*/false, std::move(leaves)};
}

void TenantMemory::Add(int64_t session, int64_t bytes) {
  const std::lock_guard lock(mutex_);
  const auto share = sessions_.find(session);
  if (share == sessions_.end()) return;
  share->second.bytes += bytes;
  tenants_[share->second.tenant] += bytes;
}

void TenantMemory::Forget(int64_t session) {
  const std::lock_guard lock(mutex_);
  const auto share = sessions_.find(session);
  if (share == sessions_.end()) return;
  const auto tenant = tenants_.find(share->second.tenant);
  tenant->second -= share->second.bytes;
  if (tenant->second == 0) tenants_.erase(tenant);
  left_bytes_ += share->second.bytes;
  sessions_.erase(share);
}

// The allocator would keep what was freed between blocks that are still in use: a tenant that
// creates session after session would make the daemon hold twice what the tenant may.
void TenantMemory::Trim() {
  {
    const std::lock_guard lock(mutex_);
    if (left_bytes_ < max_mb_ * kBytesOfMebibyte / 2) return;
    left_bytes_ = 0;
  }
  malloc_trim(0);
}

absl::Status TenantMemory::MakeRoom(const std::string& tenant, int64_t more) {
  if (max_mb_ == 0) return absl::OkStatus();
  const int64_t limit = max_mb_ * kBytesOfMebibyte;
  if (more > limit) return TooLarge(more, max_mb_);
  int64_t excess = OfTenant(tenant) + more - limit;
  if (excess <= 0) return absl::OkStatus();
  // Sessions are asked without the lock held, because they weigh themselves with locks of their
  // own.
  using Idle = std::tuple<Session::Clock::duration, int64_t, std::shared_ptr<Session>>;
  std::vector<Idle> idle;
  for (auto& [bytes, session] : Candidates(tenant, excess)) {
    const auto time = session->IdleTime();
    if (time) idle.emplace_back(*time, bytes, std::move(session));
  }
  std::sort(idle.begin(), idle.end(), std::greater<>());
  for (const auto& [time, bytes, session] : idle) {
    if (excess <= 0) break;
    // Noted first, because the session may have left, and come back, before Submit returns.
    NoteLeaving(session->number(), true);
    const auto unload = [this, session = session, time = time] {  // the session keeps this alive
      session->Unload(time);
      Trim();
    };
    if (session->strand().Submit(unload).ok()) {
      excess -= bytes;
    } else {  // the daemon is busy
      NoteLeaving(session->number(), false);
    }
  }
  return excess <= 0 ? absl::OkStatus() : NoRoom(excess + limit - more, more, max_mb_);
}

std::vector<std::pair<int64_t, std::shared_ptr<Session>>> TenantMemory::Candidates(
    const std::string& tenant, int64_t& excess) {
  std::vector<std::pair<int64_t, std::shared_ptr<Session>>> candidates;
  const std::lock_guard lock(mutex_);
  for (const auto& [number, share] : sessions_) {
    if (share.tenant != tenant) continue;
    if (share.leaving) excess -= share.bytes;
    auto session = share.leaving ? nullptr : share.session.lock();
    if (session != nullptr) candidates.emplace_back(share.bytes, std::move(session));
  }
  return candidates;
}

// The session may have left already.
void TenantMemory::NoteLeaving(int64_t session, bool leaving) {
  const std::lock_guard lock(mutex_);
  const auto share = sessions_.find(session);
  if (share != sessions_.end()) share->second.leaving = leaving;
}

int64_t TenantMemory::OfTenant(const std::string& tenant) const {
  const std::lock_guard lock(mutex_);
  const auto found = tenants_.find(tenant);
  return found == tenants_.end() ? 0 : found->second;
}

}  // namespace polyest::internal
