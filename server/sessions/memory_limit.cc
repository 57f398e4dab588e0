#include "server/sessions/memory_limit.h"

#include <absl/strings/str_format.h>

#include <chrono>

#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {
namespace {

// Time in which idle sessions are unloaded.
constexpr std::chrono::seconds kRetryDelay{2};

}  // namespace

absl::Status MemoryLimit::Check() const {
  if (!Exceeded()) return absl::OkStatus();
  return Refuse(absl::StatusCode::kResourceExhausted,
                absl::StrFormat("the daemon has more memory in use than it may have, %d MiB "
                                "(--max-memory-mb); try later",
                                max_mb_),
                {.reason = kOutOfMemory, .limit = "--max-memory-mb", .retry_delay = kRetryDelay});
}

}  // namespace polyest::internal
