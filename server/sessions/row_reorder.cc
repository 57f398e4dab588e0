#include "server/sessions/row_reorder.h"

#include <absl/strings/str_cat.h>
#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "proto/wire/refusal/refusal.h"

namespace polyest::internal {
namespace {

constexpr double kMaxWindow_s = 3600;

constexpr double kMissing = std::numeric_limits<double>::quiet_NaN();

bool HasSample(const SampleColumn& column, size_t row) {
  return column.missing.empty() || !column.missing[row];
}

SampleRow PlaceOf(const Samples& batch, size_t row) {
  // The sum makes a time of −0 the same as 0, to the last bit.
  return {batch.run.empty() ? 0 : batch.run[row], batch.time_s[row] + 0.0};
}

// Returns the names of the columns that have a sample in the row.
std::string ColumnsIn(const Samples& batch, size_t row) {
  std::vector<std::string> names;
  for (const SampleColumn& column : batch.columns) {
    if (HasSample(column, row)) names.push_back(column.name);
  }
  return names.empty() ? "t" : absl::StrJoin(names, ", ");
}

// Refuses a row, which the sentence is about and continues.
absl::Status RefusedRow(const char* field, size_t row, const std::string& sentence) {
  return NamedInWords(
      FieldPath{"measurements", field, row},
      absl::InvalidArgumentError(absl::StrCat(RowInWords(static_cast<int64_t>(row)), sentence)));
}

// Writes the samples of one row over those of another.
void Merge(const std::vector<double>& from, std::vector<double>& to) {
  for (size_t i = 0; i < from.size(); ++i) {
    if (!std::isnan(from[i])) to[i] = from[i];
  }
}

void AppendRow(const SampleRow& place, const std::vector<double>& values, Samples& samples) {
  samples.run.push_back(place.run);
  samples.time_s.push_back(place.time_s);
  for (size_t i = 0; i < values.size(); ++i) {
    samples.columns[i].value.push_back(values[i]);
    samples.columns[i].missing.push_back(std::isnan(values[i]));
  }
}

}  // namespace

absl::Status CheckReorderWindow(const FieldPath& field, double window_s) {
  if (window_s >= 0 && window_s <= kMaxWindow_s) return absl::OkStatus();
  return InvalidField(field, absl::StrFormat("%g must be from 0 to %g s; 0 means that rows come in "
                                             "time order",
                                             window_s, kMaxWindow_s));
}

RowReorder::RowReorder(std::vector<std::string> columns, double window_s)
    : RowReorder(std::move(columns), window_s, Resumption()) {}

RowReorder::RowReorder(std::vector<std::string> columns, double window_s, const Resumption& from)
    : columns_(std::move(columns)),
      window_s_(window_s),
      passed_over_(from.released),
      next_(from.first_batch),
      any_(from.released.has_value()),
      newest_(from.released.value_or(SampleRow())) {}

absl::StatusOr<RowReorder::Step> RowReorder::Next(const Samples& batch) const {
  Step step;
  step.any = any_;
  step.newest = newest_;
  step.run_ended = run_ended_;
  std::vector<size_t> places;
  for (const SampleColumn& column : batch.columns) {
    places.push_back(
        static_cast<size_t>(std::ranges::find(columns_, column.name) - columns_.begin()));
  }
  if (batch.rows() == 0 && !(batch.end_of_run && any_)) {
    return NamedInWords("measurements.time_s",
                        absl::InvalidArgumentError("the measurements have no rows"));
  }
  for (size_t row = 0; row < batch.rows(); ++row) {
    POLYEST_RETURN_IF_ERROR(AddRow(batch, row, places, step));
  }
  if (!step.added.empty()) step.batch.push_back({next_, std::prev(step.added.end())->first});
  step.run_ended = step.run_ended || batch.end_of_run;
  Release(step);
  const auto rows = std::ssize(held_) - step.released_of_held + std::ssize(step.added);
  if (rows > kMaxHeldRows) {
    return LimitExceeded(
        "reorderWindowS",
        absl::StrFormat("measurements.timeS: %d rows within reorderWindowS = %g s of the newest "
                        "one are more than the session can hold back, %d; choose a smaller window",
                        rows, window_s_, kMaxHeldRows));
  }
  return step;
}

absl::Status RowReorder::AddRow(const Samples& batch, size_t row, const std::vector<size_t>& places,
                                Step& step) const {
  const SampleRow place = PlaceOf(batch, row);
  if (passed_over_ && !Earlier()(*passed_over_, place)) return absl::OkStatus();
  POLYEST_RETURN_IF_ERROR(CheckPlace(batch, row, place, step));
  if (!step.any || Earlier()(step.newest, place)) {
    step.run_ended = step.run_ended && step.any && step.newest.run == place.run;
    step.newest = place;
    step.any = true;
  }
  std::vector<double>& values = step.added.try_emplace(place).first->second;
  values.resize(columns_.size(), kMissing);
  for (size_t i = 0; i < places.size(); ++i) {
    if (!HasSample(batch.columns[i], row)) continue;
    if (Holds(held_, place, places[i]) || !std::isnan(values[places[i]])) {
      return RefusedRow(
          "time_s", row,
          absl::StrFormat(", column %s: there is another sample at t = %.17g s of run %d",
                          batch.columns[i].name, place.time_s, place.run));
    }
    values[places[i]] = batch.columns[i].value[row];
  }
  return absl::OkStatus();
}

absl::Status RowReorder::CheckPlace(const Samples& batch, size_t row, const SampleRow& place,
                                    const Step& step) const {
  if (step.any ? place.run < step.newest.run : place.run != 0) {
    const std::string before = step.any ? absl::StrFormat(" after %d", step.newest.run) : "";
    return RefusedRow("run", row,
                      absl::StrFormat(", column run: %d%s; runs start at 0 and never decrease",
                                      place.run, before));
  }
  if (!step.any || place.run > step.newest.run) return absl::OkStatus();
  if (step.run_ended) {
    return RefusedRow(
        "run", row,
        absl::StrFormat(": run %d has ended; further rows belong to a new run", place.run));
  }
  if (!IsDue(place, step)) return absl::OkStatus();
  return RefusedRow(
      "time_s", row,
      absl::StrFormat(
          ", column %s: t = %.17g s comes too late: the newest row is at %.17g "
          "s, and the rows more than reorderWindowS = %g s before it, up to %.17g s, have "
          "been released to the estimator",
          ColumnsIn(batch, row), place.time_s, step.newest.time_s, window_s_,
          step.newest.time_s - window_s_));
}

bool RowReorder::Holds(const Rows& rows, const SampleRow& place, size_t column) const {
  const auto found = rows.find(place);
  return found != rows.end() && !std::isnan(found->second[column]);
}

// Returns whether no more rows may come up to this place.
bool RowReorder::IsDue(const SampleRow& place, const Step& step) const {
  return step.run_ended || place.run < step.newest.run ||
         step.newest.time_s - place.time_s > window_s_;
}

// Moves the rows that are due from those held back, which stay until the step is accepted, and from
// those that the batch adds.
void RowReorder::Release(Step& step) const {
  for (const std::string& name : columns_) step.released.columns.push_back({name, {}, {}});
  auto held = held_.begin();
  while (true) {
    const auto added = step.added.begin();
    const bool of_held = held != held_.end() && IsDue(held->first, step);
    const bool of_added = added != step.added.end() && IsDue(added->first, step);
    if (!of_held && !of_added) break;
    const bool held_first = of_held && !(of_added && Earlier()(added->first, held->first));
    const bool added_first = of_added && !(of_held && Earlier()(held->first, added->first));
    if (held_first && added_first) Merge(held->second, added->second);
    AppendRow(added_first ? added->first : held->first, added_first ? added->second : held->second,
              step.released);
    if (added_first) step.added.erase(added);
    if (held_first) {
      ++held;
      ++step.released_of_held;
    }
  }
  step.released.end_of_run =
      step.run_ended || (step.released.rows() > 0 && step.released.run.back() < step.newest.run);
}

int64_t RowReorder::held_bytes() const {
  // A row has a node of the tree, with three links and a colour, and an array. The allocator adds
  // about two words to each.
  constexpr size_t kRowBytes = sizeof(Rows::value_type) + 8 * sizeof(void*);
  return held_rows() * static_cast<int64_t>(kRowBytes + columns_.size() * sizeof(double));
}

void RowReorder::Accept(Step step) {
  held_.erase(held_.begin(), std::next(held_.begin(), step.released_of_held));
  while (!step.added.empty()) {
    const auto result = held_.insert(step.added.extract(step.added.begin()));
    if (!result.inserted) Merge(result.node.mapped(), result.position->second);
  }
  any_ = step.any;
  newest_ = step.newest;
  run_ended_ = step.run_ended;
  ++next_;
  batches_.splice(batches_.end(), step.batch);
  const auto released = [&](const Batch& batch) {
    return held_.empty() || Earlier()(batch.newest, held_.begin()->first);
  };
  while (!batches_.empty() && released(batches_.front())) batches_.pop_front();
}

}  // namespace polyest::internal
