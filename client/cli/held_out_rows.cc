#include "client/cli/held_out_rows.h"

#include <algorithm>

namespace polyest::internal {

v1::Measurements FirstRows(const v1::Measurements& measurements, int64_t rows) {
  v1::Measurements first = measurements;
  const auto count = static_cast<int>(rows);
  first.mutable_time_s()->Truncate(count);
  first.mutable_run()->Truncate(std::min(count, first.run_size()));
  for (v1::Measurements::Channel& channel : *first.mutable_channels()) {
    channel.mutable_values()->Truncate(count);
    const auto& missing = channel.missing();
    const auto end = std::lower_bound(missing.begin(), missing.end(), count);
    channel.mutable_missing()->Truncate(static_cast<int>(end - missing.begin()));
  }
  return first;
}

}  // namespace polyest::internal
