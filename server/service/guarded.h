#pragma once

#include <absl/status/status.h>

#include <new>
#include <utility>

#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {

// Runs `work`, and turns a lack of memory into RESOURCE_EXHAUSTED. A request may be within every
// limit and still need more memory than there is; then the request fails, not the daemon.
template <typename Work>
absl::Status Guarded(Work&& work) {
  try {
    return std::forward<Work>(work)();
  } catch (const std::bad_alloc&) {
    return Refuse(absl::StatusCode::kResourceExhausted,
                  "the daemon has not enough memory for this request", {.reason = kOutOfMemory});
  }
}

}  // namespace polyest::internal
