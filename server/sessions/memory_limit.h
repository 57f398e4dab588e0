#pragma once

// Whether the daemon may take more memory: new sessions, estimators that come back from disk and
// computations without a session are refused while it has more than it may have. What is in memory
// goes on, so that streams that are open are acknowledged as ever.

#include <absl/status/status.h>

#include <cstdint>
#include <functional>

#include "server/telemetry/process_info.h"

namespace polyest::internal {

// From any thread.
class MemoryLimit {
 public:
  // max_mb: MiB, --max-memory-mb; 0: none. resident_bytes: of the process.
  explicit MemoryLimit(int64_t max_mb = 0,
                       std::function<int64_t()> resident_bytes = ResidentMemoryBytes)
      : max_mb_(max_mb), resident_bytes_(std::move(resident_bytes)) {}

  bool limited() const { return max_mb_ > 0; }
  bool Exceeded() const { return limited() && resident_bytes_() > max_mb_ * 1024 * 1024; }
  // RESOURCE_EXHAUSTED while it is exceeded; trying again later may help.
  absl::Status Check() const;

 private:
  const int64_t max_mb_;
  const std::function<int64_t()> resident_bytes_;
};

}  // namespace polyest::internal
