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

v1::Measurements WithoutFirstSamples(const v1::Measurements& measurements,
                                     const v1::Problem& problem, int64_t rows) {
  v1::Measurements rest = measurements;
  for (v1::Measurements::Channel& channel : *rest.mutable_channels()) {
    const bool measured = std::ranges::any_of(
        problem.measured(), [&](const auto& output) { return output.output() == channel.name(); });
    if (!measured) continue;
    google::protobuf::RepeatedField<int32_t> missing;
    for (int row = 0; row < rows; ++row) missing.Add(row);
    const auto& own = channel.missing();
    missing.Add(std::lower_bound(own.begin(), own.end(), rows), own.end());
    channel.mutable_missing()->Swap(&missing);
  }
  return rest;
}

}  // namespace polyest::internal
