#include "proto/wire/convert/measurements.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>
#include <vector>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/model/unit_conversion.h"
#include "proto/wire/convert/annotate.h"

namespace polyest::internal {
namespace {

absl::Status CheckTime(const v1::Measurements& measurements) {
  for (int row = 0; row < measurements.time_s_size(); ++row) {
    if (!std::isfinite(measurements.time_s(row))) {
      return InvalidField(FieldPath{"measurements", "timeS", row},
                          absl::StrFormat("%g must be finite", measurements.time_s(row)));
    }
  }
  if (measurements.run_size() != 0 && measurements.run_size() != measurements.time_s_size()) {
    return InvalidField("measurements.run",
                        absl::StrFormat("%d entries for %d rows; must be one per row, or none",
                                        measurements.run_size(), measurements.time_s_size()));
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

// Returns the unit of an output or an input; empty if there is none.
std::string UnitOf(const std::string& name, const ModelDescription& model) {
  if (const auto output = model.FindOutput(name)) {
    return model.outputs[static_cast<size_t>(*output)].unit;
  }
  const auto input = model.FindInput(name);
  return input ? model.inputs[static_cast<size_t>(*input)].unit : "";
}

absl::StatusOr<UnitConversion> ConversionOf(const v1::Measurements::Channel& channel,
                                            const Model& model, const std::string& path) {
  if (channel.unit().empty()) return UnitConversion();
  const std::string unit = UnitOf(channel.name(), model.description());
  if (unit.empty()) {
    return InvalidField(path + ".unit",
                        absl::StrFormat("\"%s\": the model gives %s no unit to convert it to",
                                        channel.unit(), channel.name()));
  }
  absl::StatusOr<UnitConversion> conversion = ConvertUnit(channel.unit(), unit);
  if (conversion.ok()) return conversion;
  return InvalidField(path + ".unit",
                      absl::StrFormat("%s: %s", channel.name(), conversion.status().message()));
}

absl::StatusOr<SampleColumn> ToColumn(const v1::Measurements::Channel& channel, int rows,
                                      const Model& model, const std::string& path) {
  if (channel.name().empty()) return InvalidField(path + ".name", "must not be empty");
  if (channel.values_size() != rows) {
    return InvalidField(path + ".values",
                        absl::StrFormat("%d values of %s for %d rows; must be one per row",
                                        channel.values_size(), channel.name(), rows));
  }
  SampleColumn column;
  column.name = channel.name();
  POLYEST_ASSIGN_OR_RETURN(column.missing, ToMissing(channel, rows, path));
  POLYEST_ASSIGN_OR_RETURN(const UnitConversion conversion, ConversionOf(channel, model, path));
  column.value.assign(channel.values().begin(), channel.values().end());
  if (!conversion.IsIdentity()) {
    std::transform(column.value.begin(), column.value.end(), column.value.begin(), conversion);
  }
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

v1::Measurements::Channel& ChannelOf(const std::string& name, v1::Measurements& measurements) {
  for (v1::Measurements::Channel& channel : *measurements.mutable_channels()) {
    if (channel.name() == name) return channel;
  }
  v1::Measurements::Channel& added = *measurements.add_channels();
  added.set_name(name);
  return added;
}

// Adds rows without a sample until the channel has `rows` rows.
void FillUp(int rows, v1::Measurements::Channel& channel) {
  for (int row = channel.values_size(); row < rows; ++row) {
    channel.add_values(0);
    channel.add_missing(row);
  }
}

// Returns the channel with the sample of each row moved to row `to` of `count`.
v1::Measurements::Channel Moved(const v1::Measurements::Channel& channel,
                                const std::vector<int>& to, int count) {
  v1::Measurements::Channel moved;
  moved.set_name(channel.name());
  moved.set_unit(channel.unit());
  moved.mutable_values()->Resize(count, 0);
  std::vector<bool> has(static_cast<size_t>(count), false);
  auto missing = channel.missing().begin();
  for (int row = 0; row < channel.values_size(); ++row) {
    if (missing != channel.missing().end() && *missing == row) {
      ++missing;
      continue;
    }
    const int place = to[static_cast<size_t>(row)];
    moved.set_values(place, channel.values(row));
    has[static_cast<size_t>(place)] = true;
  }
  for (int row = 0; row < count; ++row) {
    if (!has[static_cast<size_t>(row)]) moved.add_missing(row);
  }
  return moved;
}

}  // namespace

absl::StatusOr<Samples> ToSamples(const v1::Measurements& measurements, const Model& model) {
  POLYEST_RETURN_IF_ERROR(CheckTime(measurements));
  Samples samples;
  samples.time_s.assign(measurements.time_s().begin(), measurements.time_s().end());
  samples.run.assign(measurements.run().begin(), measurements.run().end());
  samples.end_of_run = measurements.end_of_run();
  samples.columns.reserve(static_cast<size_t>(measurements.channels_size()));
  for (int i = 0; i < measurements.channels_size(); ++i) {
    POLYEST_ASSIGN_OR_RETURN(SampleColumn column,
                             ToColumn(measurements.channels(i), measurements.time_s_size(), model,
                                      absl::StrFormat("measurements.channels[%d]", i)));
    samples.columns.push_back(std::move(column));
  }
  return samples;
}

void AppendRows(const v1::Measurements& batch, v1::Measurements& all) {
  const int before = all.time_s_size();
  if (batch.run_size() != 0 || all.run_size() != 0) {
    all.mutable_run()->Resize(before, 0);
    all.mutable_run()->MergeFrom(batch.run());
    all.mutable_run()->Resize(before + batch.time_s_size(), 0);
  }
  all.mutable_time_s()->MergeFrom(batch.time_s());
  all.set_end_of_run(batch.end_of_run());
  for (const v1::Measurements::Channel& channel : batch.channels()) {
    v1::Measurements::Channel& added = ChannelOf(channel.name(), all);
    FillUp(before, added);
    added.mutable_values()->MergeFrom(channel.values());
    for (const int row : channel.missing()) added.add_missing(before + row);
  }
  for (v1::Measurements::Channel& channel : *all.mutable_channels()) {
    FillUp(all.time_s_size(), channel);
  }
}

void AppendRows(const Samples& rows, v1::Measurements& all) {
  v1::Measurements batch;
  batch.mutable_time_s()->Add(rows.time_s.begin(), rows.time_s.end());
  batch.mutable_run()->Add(rows.run.begin(), rows.run.end());
  batch.set_end_of_run(rows.end_of_run);
  for (const SampleColumn& column : rows.columns) {
    v1::Measurements::Channel& channel = *batch.add_channels();
    channel.set_name(column.name);
    channel.mutable_values()->Add(column.value.begin(), column.value.end());
    for (size_t row = 0; row < column.missing.size(); ++row) {
      if (column.missing[row]) channel.add_missing(static_cast<int32_t>(row));
    }
  }
  AppendRows(batch, all);
}

void PutInTimeOrder(v1::Measurements& rows) {
  const auto place = [&](int row) {
    return std::pair(rows.run().empty() ? 0 : rows.run(row), rows.time_s(row));
  };
  std::vector<int> order(static_cast<size_t>(rows.time_s_size()));
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, place);
  v1::Measurements ordered;
  std::vector<int> becomes(order.size());  // the row that each becomes a part of
  for (size_t i = 0; i < order.size(); ++i) {
    if (i == 0 || place(order[i]) != place(order[i - 1])) {
      ordered.add_time_s(rows.time_s(order[i]));
      if (!rows.run().empty()) ordered.add_run(rows.run(order[i]));
    }
    becomes[static_cast<size_t>(order[i])] = ordered.time_s_size() - 1;
  }
  for (const v1::Measurements::Channel& channel : rows.channels()) {
    *ordered.add_channels() = Moved(channel, becomes, ordered.time_s_size());
  }
  ordered.set_end_of_run(rows.end_of_run());
  rows = std::move(ordered);
}

}  // namespace polyest::internal
