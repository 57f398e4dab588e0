#include "server/service/stream_memory.h"

#include <absl/strings/str_cat.h>

#include <chrono>

#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {

absl::Status StreamMemory::Share::CheckRoom() const {
  if (HasRoom()) return absl::OkStatus();
  // Time after which clients may have read something.
  constexpr std::chrono::seconds kRetryDelay{1};
  const bool of_tenant = *tenant_ >= memory_.limits_.tenant;
  return Refuse(
      absl::StatusCode::kResourceExhausted,
      absl::StrCat("the streams of ", of_tenant ? "the tenant" : "all tenants", " hold more than ",
                   (of_tenant ? memory_.limits_.tenant : memory_.limits_.all) >> 20,
                   " MiB that is not read or not computed; read other streams first, or try later"),
      {.reason = kBusy, .retry_delay = kRetryDelay});
}

std::shared_ptr<std::atomic<int64_t>> StreamMemory::OfTenant(const std::string& tenant) {
  const std::lock_guard lock(mutex_);
  std::erase_if(tenants_, [](const auto& entry) { return entry.second.expired(); });
  std::weak_ptr<std::atomic<int64_t>>& known = tenants_[tenant];
  std::shared_ptr<std::atomic<int64_t>> bytes = known.lock();
  if (bytes == nullptr) known = bytes = std::make_shared<std::atomic<int64_t>>(0);
  return bytes;
}

}  // namespace polyest::internal
