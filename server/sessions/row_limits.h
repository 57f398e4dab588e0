#pragma once

#include <absl/status/status.h>

#include "polyest/v1/measurements.pb.h"
#include "server/journal/session_journal.h"
#include "server/sessions/limits.h"

namespace polyest::internal {

// Refuses with RESOURCE_EXHAUSTED, naming the limit, a batch with too many rows, or with too many
// beside those that the session has so far.
absl::Status CheckRows(const SessionLimits& limits, const SessionPlace& place,
                       const v1::Measurements& batch);

}  // namespace polyest::internal
