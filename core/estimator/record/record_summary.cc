#include "core/estimator/record/record_summary.h"

#include <algorithm>
#include <cmath>

#include "core/estimator/record/row_block.h"

namespace polyest::internal {

namespace {

// Returns S of whitening.h for samples at equal distances, in the long run: P⁻ solves
//   P⁻ = a² P⁻ f/(P⁻ + f) + (1 − a²)(1 − f).
double StationaryInnovation(double a, double share) {
  const double b = 0.5 * (1 - a * a) * (1 - 2 * share);
  return b + std::sqrt(b * b + share * (1 - share) * (1 - a * a)) + share;
}

}  // namespace

double RecordSummary::Channel::RootMeanSquareNoise() const {
  return samples == 0 ? 0 : std::sqrt(noise_variance_sum / static_cast<double>(samples));
}

double RecordSummary::Channel::MeanInterval() const {
  return intervals == 0 ? 0 : interval_sum_s / static_cast<double>(intervals);
}

double RecordSummary::Channel::Correlation(const ChannelNoise& noise) const {
  return noise.time_constant_s > 0 ? std::exp(-MeanInterval() / noise.time_constant_s) : 0;
}

void RecordSummary::Channel::AddTime(const SampleRow& row) {
  if (row.run == last_run) {
    const double interval_s = row.time_s - last_time_s;
    least_interval_s = intervals == 0 ? interval_s : std::min(least_interval_s, interval_s);
    ++intervals;
    interval_sum_s += interval_s;
  } else {
    run_began_s = row.time_s;
  }
  longest_run_s = std::max(longest_run_s, row.time_s - run_began_s);
  last_run = row.run;
  last_time_s = row.time_s;
}

void RecordSummary::Add(const RowBlock& block, int row, int channels) {
  const auto k = static_cast<size_t>(row);
  const auto m = static_cast<size_t>(channels);
  const size_t width = block.width();
  channels_.resize(m);
  facts_.Add(block, row, channels);
  for (size_t c = 0; c < m; ++c) {
    const double sigma = block.noise[k * m + c];
    if (sigma <= 0) continue;  // no sample
    ++channels_[c].samples;
    channels_[c].AddTime(block.rows[k]);
    channels_[c].noise_variance_sum += sigma * sigma;
    channels_[c].largest = std::max(channels_[c].largest, std::abs(block.values[k * width + c]));
  }
  time_s_ = block.rows[k].time_s;
  ++rows_;
  const bool first_run = beginning_.rows.empty() || block.rows[k].run == beginning_.rows[0].run;
  if (!first_run || beginning_.count() >= kBeginning) return;
  AppendRows(block, row, 1, beginning_);
}

double RecordSummary::NoiseToSignal(const LearnedNoise& noise) const {
  double least = 1;
  for (size_t c = 0; c < channels_.size(); ++c) {
    if (channels_[c].largest <= 0) continue;
    const double a = channels_[c].Correlation(noise.channels[c]);
    const double variance = StationaryInnovation(a, noise.channels[c].white_share);
    const double innovation = noise.channels[c].scale * std::sqrt(variance);
    least = std::min(least, innovation * channels_[c].RootMeanSquareNoise() / channels_[c].largest);
  }
  return least;
}

int64_t RecordSummary::samples() const {
  int64_t total = 0;
  for (const Channel& channel : channels_) total += channel.samples;
  return total;
}

}  // namespace polyest::internal
