#pragma once

// Reads rows together with the later rows that determine how the streamed inputs continue.

#include <absl/status/status.h>

#include <cstdint>

#include "polyest/samples.h"

namespace polyest::internal {

// Reads rows [first, first + count) and up to `ahead` rows after them, as far as they exist.
absl::Status ReadWithRowsAhead(const SampleStore& store, int64_t first, int64_t count, int ahead,
                               RowBlock& block);

}  // namespace polyest::internal
