#include "core/estimator/record/data_facts.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace polyest::internal {
namespace {

constexpr double kMultiple = 1e-3;          // how far from a multiple of the step a value may be
constexpr double kIntegrationError = 1e-5;  // relative error of a prediction that means nothing

}  // namespace

void IntervalFacts::Add(const SampleRow& row) {
  if (rows_ == 0 || row.run != run_) {
    latest_first_s_ = std::max(latest_first_s_, row.time_s);
  } else {
    const double interval_s = row.time_s - time_s_;
    if (interval_s > longest_s_) {
      longest_s_ = interval_s;
      longest_after_s_ = time_s_;
    }
    intervals_s_.Add(interval_s);
  }
  ++rows_;
  run_ = row.run;
  time_s_ = row.time_s;
}

int64_t IntervalFacts::gaps() const {
  const double gap_s = kGapSteps * usual_s();
  if (!(longest_s_ > gap_s)) return 0;
  return std::max<int64_t>(1, intervals_s_.CountAbove(gap_s));
}

bool IntervalFacts::IsConsistent() const {
  return intervals_s_.IsConsistent() && intervals_s_.count() <= rows_ && longest_s_ >= 0 &&
         latest_first_s_ >= 0;
}

double DistanceOf(const PriorPrediction& prediction) {
  const double tolerance = kIntegrationError * prediction.mean;
  const double variance = prediction.variance + prediction.noise * prediction.noise;
  return std::abs(prediction.value - prediction.mean) / std::sqrt(variance + tolerance * tolerance);
}

void ColumnFacts::Add(double value, double noise) {
  if (samples == 0) {
    smallest = largest = value;
    min_noise = max_noise = noise;
  }
  ++samples;
  smallest = std::min(smallest, value);
  largest = std::max(largest, value);
  min_noise = std::min(min_noise, noise);
  max_noise = std::max(max_noise, noise);
  // Welford's update of the mean and the sum of squares about it.
  const double before = value - mean;
  mean += before / static_cast<double>(samples);
  square_sum += before * (value - mean);
  if (distinct.size() >= kMaxDistinct) return;
  const auto place = std::ranges::lower_bound(distinct, value);
  if (place == distinct.end() || *place != value) distinct.insert(place, value);
}

void ColumnFacts::AddPrediction(const PriorPrediction& prediction) {
  if (predicted == 0) first = prediction;
  ++predicted;
  const double error = prediction.value - prediction.mean;
  error_sum += error * error;
  deviation_sum += prediction.variance + prediction.noise * prediction.noise;
  if (DistanceOf(prediction) > DataFacts::kFar) ++far;
}

bool ColumnFacts::IsConsistent() const {
  const bool in_range =
      distinct.empty() || (distinct.front() >= smallest && distinct.back() <= largest);
  return samples >= 0 && distinct.size() <= kMaxDistinct && std::ranges::is_sorted(distinct) &&
         in_range && distinct.empty() == (samples == 0) && smallest <= largest && min_noise >= 0 &&
         min_noise <= max_noise && square_sum >= 0 && std::isfinite(mean) && far >= 0 &&
         far <= predicted && predicted <= samples && error_sum >= 0 && deviation_sum >= 0 &&
         faults.IsConsistent();
}

double ColumnFacts::Spread() const {
  return samples == 0 ? 0 : std::sqrt(square_sum / static_cast<double>(samples));
}

double ColumnFacts::Resolution(size_t least) const {
  if (distinct.size() < least) return 0;
  double step = std::numeric_limits<double>::infinity();
  for (size_t i = 1; i < distinct.size(); ++i) step = std::min(step, distinct[i] - distinct[i - 1]);
  for (const double value : distinct) {
    const double multiple = (value - distinct.front()) / step;
    if (std::abs(multiple - std::round(multiple)) > kMultiple) return 0;
  }
  return step;
}

void InputFacts::Add(const SampleRow& row, double next) {
  intervals.Add(row);
  last_s = row.time_s;
  const double change = next - value;
  if (samples_in_run > 1) bends += (change - step) * (change - step);
  step = change;
  value = next;
  ++samples_in_run;
}

void InputFacts::EndRun(double last_row_s) {
  if (samples_in_run == 0) ++runs_without;
  if (samples_in_run > 0 && last_row_s - last_s > longest_end_s) {
    longest_end_s = last_row_s - last_s;
    end_from_s = last_s;
  }
  samples_in_run = 0;
}

bool InputFacts::IsConsistent() const {
  return intervals.IsConsistent() && runs_without >= 0 && longest_end_s >= 0 &&
         samples_in_run >= 0 && bends >= 0;
}

bool DataFacts::IsFor(size_t columns, size_t inputs) const {
  return columns_.size() == columns && inputs_.size() == inputs && intervals_.IsConsistent() &&
         std::ranges::all_of(columns_, &ColumnFacts::IsConsistent) &&
         std::ranges::all_of(inputs_, &InputFacts::IsConsistent);
}

void DataFacts::EndRun() {
  for (InputFacts& input : inputs_) input.EndRun(time_s_);
  for (ColumnFacts& column : columns_) column.faults.EndRun();
  ended_run_ = run_;
}

void DataFacts::Add(const RowBlock& block, int row, int channels) {
  const auto k = static_cast<size_t>(row);
  const auto m = static_cast<size_t>(channels);
  const size_t width = block.width();
  columns_.resize(width);
  inputs_.resize(width - m);
  if (run_ >= 0 && block.rows[k].run != run_ && ended_run_ != run_) EndRun();
  run_ = block.rows[k].run;
  time_s_ = block.rows[k].time_s;
  intervals_.Add(block.rows[k]);
  for (size_t i = 0; i < width; ++i) {
    const double value = block.values[k * width + i];
    if (std::isnan(value)) continue;
    columns_[i].Add(value, i < m ? block.noise[k * m + i] : 0);
    if (i < m) {
      columns_[i].faults.Add(value);
    } else {
      inputs_[i - m].Add(block.rows[k], value);
    }
  }
  if (block.run_ended && row + 1 == block.count()) EndRun();
}

}  // namespace polyest::internal
