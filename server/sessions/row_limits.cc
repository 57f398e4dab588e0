#include "server/sessions/row_limits.h"

#include <absl/strings/str_format.h>

#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {

absl::Status CheckRows(const SessionLimits& limits, const SessionPlace& place,
                       const v1::Measurements& batch) {
  const int64_t rows = batch.time_s_size();
  if (rows > limits.batch_rows) {
    return LimitExceeded(
        "--max-batch-rows",
        absl::StrFormat("measurements.timeS: %d rows are more than a batch may have, %d "
                        "(--max-batch-rows)",
                        rows, limits.batch_rows));
  }
  if (place.rows + rows > limits.rows) {
    return LimitExceeded(
        "--max-session-rows",
        absl::StrFormat("measurements.timeS: %d rows beside the %d of the session are more than it "
                        "may have, %d (--max-session-rows)",
                        rows, place.rows, limits.rows));
  }
  return absl::OkStatus();
}

}  // namespace polyest::internal
