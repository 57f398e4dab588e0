#pragma once

// Limits the memory of the daemon. While the daemon uses more than it may, new sessions, estimators
// that come back from disk and computations without a session are refused. Sessions in memory go
// on, so that open streams are still acknowledged.

#include <absl/status/status.h>

#include <cstdint>
#include <functional>

#include "server/telemetry/process_info.h"

namespace polyest::internal {

// Thread-safe.
class MemoryLimit {
 public:
  // `max_mb` is the limit in MiB (--max-memory-mb); 0: no limit. `resident_bytes` returns the
  // resident memory of the process.
  explicit MemoryLimit(int64_t max_mb = 0,
                       std::function<int64_t()> resident_bytes = ResidentMemoryBytes)
      : max_mb_(max_mb), resident_bytes_(std::move(resident_bytes)) {}

  bool limited() const { return max_mb_ > 0; }
  bool Exceeded() const { return limited() && resident_bytes_() > max_mb_ * 1024 * 1024; }
  // Refuses with RESOURCE_EXHAUSTED while the limit is exceeded; trying again later may help.
  absl::Status Check() const;

 private:
  const int64_t max_mb_;
  const std::function<int64_t()> resident_bytes_;
};

}  // namespace polyest::internal
