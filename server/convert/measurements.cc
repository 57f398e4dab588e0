#include "server/convert/measurements.h"

#include <absl/strings/str_format.h>

#include <cmath>
#include <utility>

#include "core/common/status.h"
#include "server/convert/annotate.h"

namespace polyest {
namespace {

absl::Status CheckTime(const v1::Measurements& measurements) {
  for (int row = 0; row < measurements.time_size(); ++row) {
    if (!std::isfinite(measurements.time(row))) {
      return absl::InvalidArgumentError(
          absl::StrFormat("measurements.time[%d]: %g must be finite", row, measurements.time(row)));
    }
  }
  if (measurements.run_size() != 0 && measurements.run_size() != measurements.time_size()) {
    return absl::InvalidArgumentError(
        absl::StrFormat("measurements.run: %d entries for %d rows; must be one a row, or none",
                        measurements.run_size(), measurements.time_size()));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<bool>> ToMissing(const v1::Measurements::Channel& channel, int rows,
                                            const std::string& path) {
  if (channel.missing().empty()) return std::vector<bool>();
  std::vector<bool> missing(static_cast<size_t>(rows), false);
  int previous = -1;
  for (int i = 0; i < channel.missing_size(); ++i) {
    const int row = channel.missing(i);
    if (row <= previous || row >= rows) {
      return InvalidField(
          absl::StrFormat("%s.missing[%d]", path, i),
          absl::StrFormat("row %d of %s must be above %d and below the number of rows, %d", row,
                          channel.name(), previous, rows));
    }
    missing[static_cast<size_t>(row)] = true;
    previous = row;
  }
  return missing;
}

absl::StatusOr<SampleColumn> ToColumn(const v1::Measurements::Channel& channel, int rows,
                                      const std::string& path) {
  if (channel.name().empty()) return InvalidField(path + ".name", "must not be empty");
  if (channel.values_size() != rows) {
    return InvalidField(path + ".values",
                        absl::StrFormat("%d values of %s for %d rows; must be one a row",
                                        channel.values_size(), channel.name(), rows));
  }
  SampleColumn column;
  column.name = channel.name();
  POLYEST_ASSIGN_OR_RETURN(column.missing, ToMissing(channel, rows, path));
  column.value.assign(channel.values().begin(), channel.values().end());
  for (size_t row = 0; row < column.value.size(); ++row) {
    const bool missing = !column.missing.empty() && column.missing[row];
    if (!missing && !std::isfinite(column.value[row])) {
      return InvalidField(absl::StrFormat("%s.values[%d]", path, row),
                          absl::StrFormat("%g of %s must be finite, or its row listed in missing",
                                          column.value[row], channel.name()));
    }
  }
  return column;
}

}  // namespace

absl::StatusOr<Samples> ToSamples(const v1::Measurements& measurements) {
  POLYEST_RETURN_IF_ERROR(CheckTime(measurements));
  Samples samples;
  samples.time_s.assign(measurements.time().begin(), measurements.time().end());
  samples.run.assign(measurements.run().begin(), measurements.run().end());
  samples.end_of_run = measurements.end_of_run();
  samples.columns.reserve(static_cast<size_t>(measurements.channels_size()));
  for (int i = 0; i < measurements.channels_size(); ++i) {
    POLYEST_ASSIGN_OR_RETURN(SampleColumn column,
                             ToColumn(measurements.channels(i), measurements.time_size(),
                                      absl::StrFormat("measurements.channels[%d]", i)));
    samples.columns.push_back(std::move(column));
  }
  return samples;
}

}  // namespace polyest
