#include "core/estimator/record/record_trajectories.h"

#include <absl/strings/str_format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/common/field_error.h"
#include "core/common/status.h"

namespace polyest::internal {
namespace {

constexpr int64_t kRowsAtOnce = 64;

}  // namespace

RecordTrajectories::RecordTrajectories(const ResolvedProblem& problem, const SampleStore& store,
                                       Matrix thetas, std::vector<int> outputs,
                                       FilterUse filter_use, int threads)
    : problem_(problem),
      store_(store),
      thetas_(std::move(thetas)),
      outputs_(std::move(outputs)),
      filter_use_(std::move(filter_use)),
      threads_(threads),
      failed_(static_cast<size_t>(thetas_.rows()), false) {}

absl::Status RecordTrajectories::CheckTimes(std::span<const SampleRow> times) const {
  for (size_t i = 0; i < times.size(); ++i) {
    if (times[i].run < 0) {
      return InvalidField(FieldPath{"times", i, "run"},
                          absl::StrFormat("%d must be at least 0", times[i].run));
    }
    if (!std::isfinite(times[i].time_s) || times[i].time_s < 0) {
      return InvalidField(FieldPath{"times", i, "time_s"},
                          absl::StrFormat("%g must be a finite time ≥ 0", times[i].time_s));
    }
    if (i == 0) continue;
    const SampleRow& before = times[i - 1];
    if (times[i].run < before.run ||
        (times[i].run == before.run && times[i].time_s <= before.time_s)) {
      return InvalidField(
          FieldPath{"times", i},
          absl::StrFormat("run %d, t = %.17g s after run %d, t = %.17g s; times must increase",
                          times[i].run, times[i].time_s, before.run, before.time_s));
    }
  }
  return absl::OkStatus();
}

absl::Status RecordTrajectories::Run(int64_t rows, std::span<const SampleRow> times, Visit visit,
                                     const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(CheckTimes(times));
  times_ = times;
  next_time_ = 0;
  RowBlock block;
  for (int64_t first = 0; first < rows; first += block.count()) {
    POLYEST_RETURN_IF_ERROR(store_.Read(first, std::min(kRowsAtOnce, rows - first), block));
    for (int k = 0; k < block.count();) {
      const int run = block.rows[static_cast<size_t>(k)].run;
      int end = k + 1;
      while (end < block.count() && block.rows[static_cast<size_t>(end)].run == run) ++end;
      if (run != run_) {
        POLYEST_RETURN_IF_ERROR(FinishRun(visit, stop));
        StartRun(run, first + k);
      }
      POLYEST_RETURN_IF_ERROR(inputs_->ReadUpTo(block.rows[static_cast<size_t>(end - 1)].time_s));
      POLYEST_RETURN_IF_ERROR(Advance(block, k, end - k, first + k, visit, stop));
      k = end;
    }
  }
  POLYEST_RETURN_IF_ERROR(FinishRun(visit, stop));
  if (next_time_ == times_.size()) return absl::OkStatus();
  return InvalidField(FieldPath{"times", next_time_, "run"},
                      absl::StrFormat("the record has no run %d", times_[next_time_].run));
}

void RecordTrajectories::StartRun(int run, int64_t first_row) {
  run_ = run;
  propagator_.reset();
  filters_.reset();
  smoothers_.reset();
  inputs_ = std::make_unique<RunInputs>(problem_, &store_, run, first_row);
  if (problem_.uses_filters()) {
    const InputSignals* const signals = &inputs_->signals();
    if (filter_use_.smooth) {
      smoothers_ =
          std::make_unique<RunSmoothers>(problem_, thetas_, outputs_, run, signals, threads_);
    } else {
      filters_ = std::make_unique<RunFilters>(problem_, thetas_, outputs_, run, signals,
                                              filter_use_.horizon_s, threads_);
    }
    return;
  }
  propagator_ = std::make_unique<EnsemblePropagator>(
      problem_.MakeEnsemble(thetas_, outputs_, threads_, run), &inputs_->signals());
}

// Visits the times after the last row of the present run.
absl::Status RecordTrajectories::FinishRun(Visit visit, const Stop& stop) {
  std::vector<TrajectoryInstant> instants;
  for (; next_time_ < times_.size() && times_[next_time_].run <= run_; ++next_time_) {
    const SampleRow& time = times_[next_time_];
    if (time.run < run_) break;  // a run that the record lacks
    if (!problem_.streamed_inputs().empty()) {
      return InvalidField(
          FieldPath{"times", next_time_, "time_s"},
          absl::StrFormat("t = %g s is after the last row of run %d; the streamed inputs are not "
                          "known there",
                          time.time_s, run_));
    }
    instants.push_back({time, -1, {}, {}});
  }
  POLYEST_RETURN_IF_ERROR(VisitAll(instants, visit, stop));
  if (run_ < 0) return absl::OkStatus();
  if (smoothers_) POLYEST_RETURN_IF_ERROR(VisitMarked(visit, stop));
  for (const PointFailure& failure : RunFailures()) {
    failed_[static_cast<size_t>(failure.point)] = true;
  }
  return absl::OkStatus();
}

const std::vector<PointFailure>& RecordTrajectories::RunFailures() const {
  if (smoothers_) return smoothers_->failures();
  return filters_ ? filters_->failures() : propagator_->failures();
}

// Visits rows [first, first + count) of the block, which are of the present run, and the times
// asked for up to the last of them.
absl::Status RecordTrajectories::Advance(const RowBlock& block, int first, int count, int64_t row,
                                         Visit visit, const Stop& stop) {
  const size_t width = block.width();
  const auto channels = static_cast<size_t>(problem_.channels());
  std::vector<TrajectoryInstant> instants;
  for (int k = first; k < first + count; ++k, ++row) {
    const SampleRow& place = block.rows[static_cast<size_t>(k)];
    for (; next_time_ < times_.size() && times_[next_time_].run == run_ &&
           times_[next_time_].time_s < place.time_s;
         ++next_time_) {
      instants.push_back({times_[next_time_], -1, {}, {}});
    }
    const double* samples = block.values.data() + static_cast<size_t>(k) * width;
    const double* noise = block.noise.data() + static_cast<size_t>(k) * channels;
    instants.push_back({place, row, {samples, channels}, {noise, channels}});
    if (next_time_ < times_.size() && times_[next_time_].run == run_ &&
        times_[next_time_].time_s == place.time_s) {
      instants.push_back({times_[next_time_++], -1, {}, {}});
    }
  }
  return VisitAll(instants, visit, stop);
}

absl::Status RecordTrajectories::VisitAll(std::span<const TrajectoryInstant> instants, Visit visit,
                                          const Stop& stop) {
  if (filters_) return FilterAll(instants, visit, stop);
  if (smoothers_) return MarkAll(instants, stop);
  const auto width = std::ssize(outputs_);
  for (size_t begin = 0; begin < instants.size(); begin += kRowsAtOnce) {
    const auto part =
        instants.subspan(begin, std::min<size_t>(kRowsAtOnce, instants.size() - begin));
    std::vector<double> times;
    for (const TrajectoryInstant& instant : part) times.push_back(instant.place.time_s);
    Matrix outputs(thetas_.rows(), width * std::ssize(part));
    POLYEST_RETURN_IF_ERROR(propagator_->Advance(times, outputs, stop));
    for (size_t i = 0; i < part.size(); ++i) {
      const auto column = static_cast<Eigen::Index>(i) * width;
      POLYEST_RETURN_IF_ERROR(visit(part[i], outputs.middleCols(column, width), Matrix()));
    }
  }
  return absl::OkStatus();
}

absl::Status RecordTrajectories::FilterAll(std::span<const TrajectoryInstant> instants, Visit visit,
                                           const Stop& stop) {
  Matrix means(thetas_.rows(), std::ssize(outputs_)), deviations = means;
  for (const TrajectoryInstant& instant : instants) {
    POLYEST_RETURN_IF_ERROR(filters_->Predict(instant.place.time_s, means, deviations, stop));
    POLYEST_RETURN_IF_ERROR(visit(instant, means, deviations));
    filters_->Take(instant.place.time_s, instant.samples, instant.noise);
  }
  return absl::OkStatus();
}

absl::Status RecordTrajectories::MarkAll(std::span<const TrajectoryInstant> instants,
                                         const Stop& stop) {
  for (const TrajectoryInstant& instant : instants) {
    if (instant.row < 0 || filter_use_.visits(instant.row)) {
      POLYEST_RETURN_IF_ERROR(smoothers_->Mark(instant.place.time_s, stop));
      marked_.push_back({{instant.place, instant.row, {}, {}},
                         {instant.samples.begin(), instant.samples.end()},
                         {instant.noise.begin(), instant.noise.end()}});
    }
    if (instant.row >= 0) smoothers_->Take(instant.place.time_s, instant.samples, instant.noise);
  }
  return absl::OkStatus();
}

absl::Status RecordTrajectories::VisitMarked(Visit visit, const Stop& stop) {
  POLYEST_RETURN_IF_ERROR(smoothers_->Finish(stop));
  Matrix means(thetas_.rows(), std::ssize(outputs_)), deviations = means, jump_scores = means;
  for (size_t i = 0; i < marked_.size(); ++i) {
    TrajectoryInstant instant = marked_[i].instant;
    instant.samples = marked_[i].samples;
    instant.noise = marked_[i].noise;
    POLYEST_RETURN_IF_ERROR(smoothers_->Read(i, means, deviations));
    smoothers_->ReadJumpScores(i, jump_scores);
    instant.jump_scores = &jump_scores;
    POLYEST_RETURN_IF_ERROR(visit(instant, means, deviations));
  }
  marked_.clear();
  return absl::OkStatus();
}

int RecordTrajectories::failed() const {
  return static_cast<int>(std::count(failed_.begin(), failed_.end(), true));
}

}  // namespace polyest::internal
