#include "server/sessions/batch_intake.h"

#include <absl/cleanup/cleanup.h>

#include <algorithm>
#include <utility>

#include "core/common/status.h"
#include "proto/wire/convert/measurements.h"
#include "proto/wire/convert/wire_fields.h"

namespace polyest::internal {

BatchIntake::BatchIntake(ResolvedProblem problem, double reorder_window_s)
    : problem_(std::move(problem)), checks_(problem_), runs_(problem_.runs()) {
  if (reorder_window_s > 0) reorder_.emplace(checks_.names(), reorder_window_s);
  for (const MeasuredOutput& output : problem_.problem().measured) measured_.insert(output.output);
}

SessionPlace BatchIntake::place() const {
  const std::lock_guard lock(mutex_);
  return place_;
}

double BatchIntake::measured_s() const {
  const std::lock_guard lock(mutex_);
  return measured_s_;
}

int64_t BatchIntake::held_bytes() const {
  const std::lock_guard lock(mutex_);
  return reorder_ ? reorder_->held_bytes() : 0;
}

int64_t BatchIntake::waiting_rows() const {
  const std::lock_guard lock(mutex_);
  int64_t rows = 0;
  for (const TakenBatch& batch : waiting_) rows += static_cast<int64_t>(batch.samples.rows());
  return rows;
}

absl::Status BatchIntake::Take(const v1::Measurements& batch, const ProblemLimits& limits,
                               const Record& record) {
  POLYEST_ASSIGN_OR_RETURN(Samples samples, ToSamples(batch, *problem_.problem().model));
  const std::lock_guard lock(mutex_);
  RowReorder::Step step;
  if (reorder_) {
    POLYEST_ASSIGN_OR_RETURN(step, WireFields(PutInOrder(samples)));
  }
  const Samples& released = reorder_ ? step.released : samples;
  CheckedSamples checked;
  const bool any_released = !reorder_ || !RowReorder::IsNothing(released);
  if (any_released) {
    POLYEST_ASSIGN_OR_RETURN(checked, WireFields(checks_.Check(released)));
  }
  TakenBatch following = Following(samples);
  POLYEST_RETURN_IF_ERROR(CheckRuns(following.place.last_row.run + 1, limits));
  following.samples = reorder_ ? std::move(step.released) : std::move(samples);
  waiting_.push_back(std::move(following));
  absl::Cleanup undo = [this] { waiting_.pop_back(); };
  if (record) POLYEST_RETURN_IF_ERROR(record(waiting_.back().place));
  std::move(undo).Cancel();
  // What follows needs no memory, so that a lack of memory leaves everything as it was.
  if (any_released) checks_.Accept(checked);
  if (reorder_) {
    reorder_->Accept(std::move(step));
    waiting_.back().held_from = reorder_->held_from();
  }
  place_ = waiting_.back().place;
  measured_s_ = waiting_.back().measured_s;
  return absl::OkStatus();
}

// Checks everything about the rows that their order could not mend later on, because a batch that
// is taken cannot be refused any more when its rows are released.
absl::StatusOr<RowReorder::Step> BatchIntake::PutInOrder(const Samples& samples) const {
  if (samples.rows() > 0) POLYEST_RETURN_IF_ERROR(checks_.CheckInAnyOrder(samples));
  return reorder_->Next(samples);
}

// Checks that the problem stays valid and within the limits when new runs add parameters of their
// own.
absl::Status BatchIntake::CheckRuns(int runs, const ProblemLimits& limits) {
  if (!problem_.per_run() || runs <= runs_) return absl::OkStatus();
  const int most = problem_.max_joint_runs();  // later runs add no parameters
  if (runs_ < most) {
    POLYEST_ASSIGN_OR_RETURN(const ResolvedProblem grown, problem_.WithRuns(std::min(runs, most)));
    POLYEST_RETURN_IF_ERROR(CheckLimits(limits, grown));
  }
  runs_ = runs;
  return absl::OkStatus();
}

const TakenBatch* BatchIntake::Oldest(int64_t sequence) const {
  const std::lock_guard lock(mutex_);
  if (waiting_.empty() || waiting_.front().place.sequence > sequence) return nullptr;
  return &waiting_.front();
}

void BatchIntake::RemoveOldest() {
  const std::lock_guard lock(mutex_);
  waiting_.pop_front();
}

// Returns the next batch, in which these samples arrive, without its samples.
TakenBatch BatchIntake::Following(const Samples& samples) const {
  SessionPlace place = place_;
  double measured_s = measured_s_;
  bool any_row = place.rows > 0;
  ++place.sequence;
  place.samples += CountValues(samples);
  place.rows += static_cast<int64_t>(samples.rows());
  for (size_t row = 0; row < samples.rows(); ++row) {
    const SampleRow next{samples.run.empty() ? 0 : samples.run[row], samples.time_s[row]};
    const bool same_run = any_row && next.run == place.last_row.run;
    if (same_run && next.time_s < place.last_row.time_s) continue;  // out of order
    // A run is measured from its first row on, which may bear the time since 1970.
    if (same_run) measured_s += next.time_s - place.last_row.time_s;
    place.last_row = next;
    any_row = true;
  }
  return {.samples = {}, .place = place, .measured_s = measured_s};
}

// Counts the values of measured outputs that are not missing, as an estimate counts its samples.
int64_t BatchIntake::CountValues(const Samples& samples) const {
  int64_t values = 0;
  for (const SampleColumn& column : samples.columns) {
    if (!measured_.contains(column.name)) continue;
    values += static_cast<int64_t>(column.value.size()) -
              std::count(column.missing.begin(), column.missing.end(), true);
  }
  return values;
}

}  // namespace polyest::internal
