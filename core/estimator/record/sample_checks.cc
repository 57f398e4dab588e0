#include "core/estimator/record/sample_checks.h"

#include <absl/strings/str_format.h>
#include <absl/strings/str_join.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "core/common/field_error.h"
#include "core/common/status.h"
#include "core/propagation/output_limit.h"

namespace polyest::internal {
namespace {

// Maximum distance of a sample from zero, in standard deviations of its noise. A larger one
// indicates a wrong unit or a wrong noise, and its square would drown all other samples in rounding
// errors.
constexpr double kMaxSignalToNoise = 1e9;
// The least positive time and the largest one, s. Times outside come from damaged files and from
// time stamps in other units, such as nanoseconds since 1970, and no solver could reach them.
constexpr double kMinTimeS = 1e-30;
constexpr double kMaxTimeS = 1e12;
// A sample, or noise, below this magnitude is 0: its square would be none. No unit has such values.
constexpr double kMinSize = 1e-100;

// Returns an error that names the place by row and column, as the user knows it. `field` is
// relative to the samples.
template <class... Arguments>
absl::Status Refusal(const FieldPath& field, const absl::FormatSpec<Arguments...>& format,
                     const Arguments&... arguments) {
  return NamedInWords(FieldPath("measurements").Then(field),
                      absl::InvalidArgumentError(absl::StrFormat(format, arguments...)));
}

// Returns an error of a row, which the sentence begins with.
template <class... Arguments>
absl::Status RowRefusal(const FieldPath& field, size_t row,
                        const absl::FormatSpec<Arguments...>& format,
                        const Arguments&... arguments) {
  return Refusal(field, "%s%s", RowInWords(static_cast<int64_t>(row)),
                 absl::StrFormat(format, arguments...));
}

FieldPath ValueAt(const Samples& samples, const SampleColumn& column, size_t row) {
  return {"columns", &column - samples.columns.data(), "value", row};
}

bool Missing(const SampleColumn& column, size_t row) {
  return !column.missing.empty() && column.missing[row];
}

// Refuses a sample that is too large for its noise, unless the noise is to be estimated.
absl::Status CheckSize(const Samples& samples, const SampleColumn& column, size_t row,
                       const NoiseModel& noise, double sigma) {
  const double z = column.value[row];
  if (noise.unknown || std::abs(z) <= kMaxSignalToNoise * sigma) return absl::OkStatus();
  return RowRefusal(ValueAt(samples, column, row), row,
                    ", column %s: %g is more than %g times its noise of %g; check its unit "
                    "or the noise",
                    column.name, z, kMaxSignalToNoise, sigma);
}

}  // namespace

RecordPosition After(const RecordPosition& position, const RowBlock& block) {
  RecordPosition after = position;
  const auto channels = static_cast<size_t>(position.largest.size());
  const size_t width = block.width();
  for (size_t k = 0; k < block.rows.size(); ++k) {
    const SampleRow& row = block.rows[k];
    const bool same_run = after.rows > 0 && row.run == after.run;
    after.rows_in_run = same_run ? after.rows_in_run + 1 : 1;
    if (!same_run) after.knots.assign(after.knots.size(), {});
    after.run = row.run;
    after.time_s = row.time_s;
    for (size_t i = 0; i < after.knots.size(); ++i) {
      if (!std::isnan(block.values[k * width + channels + i])) after.knots[i].Add(after.rows);
    }
    ++after.rows;
    for (size_t i = 0; i < channels; ++i) {
      const double z = block.values[k * width + i];
      if (std::isnan(z)) continue;
      double& largest = after.largest[static_cast<Eigen::Index>(i)];
      largest = std::max(largest, std::abs(z));
    }
  }
  after.run_ended = block.run_ended;
  if (!block.gate.empty()) after.gate = block.gate;
  return after;
}

SampleChecks::SampleChecks(const ResolvedProblem& problem, const RecordPosition& position)
    : SampleChecks(problem) {
  position_ = position;
}

SampleChecks::SampleChecks(const ResolvedProblem& problem)
    : problem_(problem), max_runs_(problem.max_runs()) {
  for (const MeasuredOutput& measured : problem.problem().measured) {
    names_.push_back(measured.output);
  }
  for (const int column : problem.streamed_inputs()) {
    names_.push_back(
        problem.problem().model->description().inputs[static_cast<size_t>(column)].name);
  }
  width_ = names_.size();
  if (const RowGate* gate = problem.gate(); gate != nullptr) {
    for (const std::string& name : gate->columns()) {
      if (std::ranges::find(names_, name) == names_.end()) names_.push_back(name);
    }
    position_.gate.assign(gate->columns().size(), std::numeric_limits<double>::quiet_NaN());
  }
  position_.largest = Vector::Zero(problem.channels());
  position_.knots.resize(problem.streamed_inputs().size());
}

absl::StatusOr<CheckedSamples> SampleChecks::Check(const Samples& samples) const {
  POLYEST_RETURN_IF_ERROR(CheckColumns(samples));
  POLYEST_RETURN_IF_ERROR(CheckTimes(samples));
  POLYEST_RETURN_IF_ERROR(CheckValues(samples));
  CheckedSamples checked;
  const std::vector<bool> used = UsedRows(samples, checked.gate);
  checked.left_out = std::ranges::count(used, false);
  Vector largest_so_far = position_.largest;
  const auto channels = static_cast<size_t>(problem_.channels());
  checked.values.assign(samples.rows() * width_, std::numeric_limits<double>::quiet_NaN());
  checked.noise.assign(samples.rows() * channels, 0);
  for (const SampleColumn& column : samples.columns) {
    const auto place = static_cast<size_t>(std::ranges::find(names_, column.name) - names_.begin());
    if (place < channels) {
      POLYEST_RETURN_IF_ERROR(PlaceColumn(
          samples, column, used, largest_so_far[static_cast<Eigen::Index>(place)], checked));
    } else if (place < width_) {
      for (size_t k = 0; k < samples.rows(); ++k) {
        if (!Missing(column, k)) checked.values[k * width_ + place] = column.value[k];
      }
    }
  }
  for (size_t k = 0; k < samples.rows(); ++k) {
    checked.rows.push_back({samples.run.empty() ? 0 : samples.run[k], samples.time_s[k]});
  }
  checked.run_ended = samples.end_of_run;
  checked.after = After(position_, checked);
  return checked;
}

absl::Status SampleChecks::CheckInAnyOrder(const Samples& samples) const {
  POLYEST_RETURN_IF_ERROR(CheckColumns(samples));
  for (size_t k = 0; k < samples.rows(); ++k) {
    POLYEST_RETURN_IF_ERROR(CheckPlace(samples, k));
  }
  POLYEST_RETURN_IF_ERROR(CheckValues(samples));
  for (const SampleColumn& column : samples.columns) {
    POLYEST_RETURN_IF_ERROR(CheckSizes(samples, column));
  }
  return absl::OkStatus();
}

// Checks the samples of a column against the least noise that they may have: their noise grows with
// the largest sample before them, which may still arrive.
absl::Status SampleChecks::CheckSizes(const Samples& samples, const SampleColumn& column) const {
  const auto place = static_cast<size_t>(std::ranges::find(names_, column.name) - names_.begin());
  if (place >= static_cast<size_t>(problem_.channels())) return absl::OkStatus();
  const NoiseModel& noise = problem_.problem().measured[place].noise;
  const double largest_so_far = position_.largest[static_cast<Eigen::Index>(place)];
  for (size_t k = 0; k < samples.rows(); ++k) {
    if (Missing(column, k) || samples.time_s[k] < problem_.used_from_s()[place]) continue;
    const double z = column.value[k];
    const double sigma = noise.StandardDeviation(z, std::max(largest_so_far, std::abs(z)));
    if (sigma < kMinSize) continue;
    POLYEST_RETURN_IF_ERROR(CheckSize(samples, column, k, noise, sigma));
  }
  return absl::OkStatus();
}

// Returns which rows are used, and in `gate` the gate's values after the last one.
std::vector<bool> SampleChecks::UsedRows(const Samples& samples, std::vector<double>& gate) const {
  if (problem_.gate() == nullptr || samples.rows() == 0) {
    return std::vector<bool>(samples.rows(), true);
  }
  gate = position_.gate;
  const std::vector<std::string>& names = problem_.gate()->columns();
  std::vector<const SampleColumn*> columns;
  for (const std::string& name : names) {
    const auto found = std::ranges::find(samples.columns, name, &SampleColumn::name);
    columns.push_back(found == samples.columns.end() ? nullptr : &*found);
  }
  Matrix values(static_cast<Eigen::Index>(samples.rows()), std::ssize(names));
  bool any_row = position_.rows > 0;
  int run = position_.run;
  for (size_t k = 0; k < samples.rows(); ++k) {
    const int row_run = samples.run.empty() ? 0 : samples.run[k];
    if (any_row && row_run != run) gate.assign(gate.size(), std::nan(""));
    any_row = true;
    run = row_run;
    for (size_t i = 0; i < columns.size(); ++i) {
      if (columns[i] != nullptr && !Missing(*columns[i], k)) gate[i] = columns[i]->value[k];
      values(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(i)) = gate[i];
    }
  }
  return problem_.gate()->Uses(values, samples.time_s);
}

// Places the samples of a measured output, each with its noise. `largest`: max |z| so far.
absl::Status SampleChecks::PlaceColumn(const Samples& samples, const SampleColumn& column,
                                       const std::vector<bool>& used, double& largest,
                                       CheckedSamples& checked) const {
  const auto place = static_cast<size_t>(std::ranges::find(names_, column.name) - names_.begin());
  const auto channels = static_cast<size_t>(problem_.channels());
  const NoiseModel& noise = problem_.problem().measured[place].noise;
  for (size_t k = 0; k < samples.rows(); ++k) {
    // Before the largest delay the sensor shows what was before the run.
    const bool before_run = samples.time_s[k] < problem_.used_from_s()[place];
    if (Missing(column, k) || !used[k] || before_run) continue;
    const double z = std::abs(column.value[k]) < kMinSize ? 0 : column.value[k];
    largest = std::max(largest, std::abs(z));
    const double sigma = noise.StandardDeviation(z, largest);
    // 0 before any other value: without a size, it counts as missing.
    if (sigma < kMinSize) continue;
    POLYEST_RETURN_IF_ERROR(CheckSize(samples, column, k, noise, sigma));
    checked.values[k * width_ + place] = z;
    checked.noise[k * channels + place] = sigma;
  }
  return absl::OkStatus();
}

absl::Status SampleChecks::CheckColumns(const Samples& samples) const {
  if (samples.rows() == 0) {
    if (samples.end_of_run && position_.rows > 0) return absl::OkStatus();
    return Refusal("time_s", "the measurements have no rows");
  }
  if (!samples.run.empty() && samples.run.size() != samples.rows()) {
    return Refusal("run", "run: %d values for %d rows", samples.run.size(), samples.rows());
  }
  std::set<std::string> seen;
  for (const SampleColumn& column : samples.columns) {
    if (std::find(names_.begin(), names_.end(), column.name) == names_.end()) {
      return Refusal({"columns", &column - samples.columns.data()},
                     "column \"%s\" is neither a measured output nor a streamed input of the "
                     "problem%s; it has %s",
                     column.name, problem_.gate() == nullptr ? "" : ", nor in useWhen",
                     absl::StrJoin(names_, ", "));
    }
    if (!seen.insert(column.name).second) {
      return Refusal({"columns", &column - samples.columns.data()}, "column %s is given twice",
                     column.name);
    }
    if (column.value.size() != samples.rows()) {
      return Refusal({"columns", &column - samples.columns.data()},
                     "column %s: %d values for %d rows", column.name, column.value.size(),
                     samples.rows());
    }
    if (!column.missing.empty() && column.missing.size() != samples.rows()) {
      return Refusal({"columns", &column - samples.columns.data()},
                     "column %s: %d missing flags for %d rows", column.name, column.missing.size(),
                     samples.rows());
    }
  }
  return absl::OkStatus();
}

absl::Status SampleChecks::CheckTimes(const Samples& samples) const {
  RecordPosition before = position_;
  for (size_t k = 0; k < samples.rows(); ++k) {
    const double time_s = samples.time_s[k];
    const int run = samples.run.empty() ? 0 : samples.run[k];
    POLYEST_RETURN_IF_ERROR(CheckPlace(samples, k));
    if (before.rows == 0 ? run != 0 : run < before.run) {
      return RowRefusal({"run", k}, k,
                        ", column run: %d after %d; runs start at 0 and never decrease", run,
                        before.run);
    }
    if (before.run_ended && run == before.run) {
      return RowRefusal({"run", k}, k, ": run %d has ended; further rows belong to a new run", run);
    }
    if (before.rows > 0 && run == before.run && time_s <= before.time_s) {
      return RowRefusal({"time_s", k}, k,
                        ", column t: %.17g after %.17g; times must increase within a run", time_s,
                        before.time_s);
    }
    before.run = run;
    before.run_ended = false;
    before.time_s = time_s;
    ++before.rows;
  }
  return absl::OkStatus();
}

absl::Status SampleChecks::CheckPlace(const Samples& samples, size_t row) const {
  const double time_s = samples.time_s[row];
  const int run = samples.run.empty() ? 0 : samples.run[row];
  if (run < 0) {
    return RowRefusal({"run", row}, row, ", column run: %d; runs start at 0 and never decrease",
                      run);
  }
  if (run >= max_runs_) {
    return RowRefusal(
        {"run", row}, row,
        ", column run: %d must be below %d: each run has parameters of its own, and more "
        "runs would have too many of them; they are eliminated only from an adaptive expansion "
        "of output errors and if the runs share a parameter",
        run, max_runs_);
  }
  if (!std::isfinite(time_s) || time_s < 0) {
    return RowRefusal({"time_s", row}, row, ", column t: %g must be a finite time ≥ 0", time_s);
  }
  if ((time_s > 0 && time_s < kMinTimeS) || time_s > kMaxTimeS) {
    return RowRefusal({"time_s", row}, row,
                      ", column t: %g must be 0 or a time from %g to %g s; check its unit", time_s,
                      kMinTimeS, kMaxTimeS);
  }
  return absl::OkStatus();
}

absl::Status SampleChecks::CheckValues(const Samples& samples) const {
  for (const SampleColumn& column : samples.columns) {
    for (size_t k = 0; k < samples.rows(); ++k) {
      if (Missing(column, k) || std::abs(column.value[k]) <= kMaxOutput) continue;
      return RowRefusal(ValueAt(samples, column, k), k,
                        ", column %s: %g must be a finite number, of at most 1e100 in magnitude",
                        column.name, column.value[k]);
    }
  }
  return absl::OkStatus();
}

}  // namespace polyest::internal
