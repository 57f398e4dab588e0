#pragma once

#include <absl/status/status.h>
#include <spdlog/spdlog.h>

#include <exception>
#include <new>
#include <type_traits>
#include <utility>

#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {

// Runs `work`, which returns a Status or a StatusOr, and turns a lack of memory into
// RESOURCE_EXHAUSTED: a request may be within every limit and still need more memory than there is.
// Any other exception is a fault of the daemon and becomes INTERNAL. Either way the request fails,
// not the daemon.
template <typename Work>
std::invoke_result_t<Work> Guarded(Work&& work) {
  try {
    return std::forward<Work>(work)();
  } catch (const std::bad_alloc&) {
    return Refuse(absl::StatusCode::kResourceExhausted,
                  "the daemon has not enough memory for this request", {.reason = kOutOfMemory});
  } catch (const std::exception& fault) {
    spdlog::error("a request met a fault of the daemon: {}", fault.what());
    return absl::InternalError("the daemon has a fault, which its log names");
  }
}

}  // namespace polyest::internal
