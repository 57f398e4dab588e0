#include "client/cli/first_rows.h"

#include <algorithm>

namespace polyest::internal {

v1::Measurements FirstRows(v1::Measurements measurements, int64_t rows) {
  if (rows >= measurements.time_s_size()) return measurements;
  const auto count = static_cast<int>(rows);
  measurements.mutable_time_s()->Truncate(count);
  if (!measurements.run().empty()) measurements.mutable_run()->Truncate(count);
  for (v1::Measurements::Channel& channel : *measurements.mutable_channels()) {
    channel.mutable_values()->Truncate(count);
    const auto& missing = channel.missing();
    const auto kept = std::ranges::lower_bound(missing, count) - missing.begin();
    channel.mutable_missing()->Truncate(static_cast<int>(kept));
  }
  return measurements;
}

}  // namespace polyest::internal
