#include "core/estimator/record_summary.h"

#include <algorithm>
#include <cmath>

namespace polyest {

double RecordSummary::Channel::RootMeanSquareNoise() const {
  return samples == 0 ? 0 : std::sqrt(noise_variance_sum / static_cast<double>(samples));
}

void RecordSummary::Add(const RowBlock& block, int row, int channels) {
  const auto k = static_cast<size_t>(row);
  const auto m = static_cast<size_t>(channels);
  const size_t width = block.values.size() / block.rows.size();
  channels_.resize(m);
  for (size_t c = 0; c < m; ++c) {
    const double sigma = block.noise[k * m + c];
    if (sigma <= 0) continue;  // no sample
    ++channels_[c].samples;
    channels_[c].noise_variance_sum += sigma * sigma;
    channels_[c].largest = std::max(channels_[c].largest, std::abs(block.values[k * width + c]));
  }
  time_s_ = block.rows[k].time_s;
  ++rows_;
  const bool first_run = beginning_.rows.empty() || block.rows[k].run == beginning_.rows[0].run;
  if (!first_run || beginning_.count() >= kBeginning) return;
  const auto values = block.values.begin() + static_cast<std::ptrdiff_t>(k * width);
  const auto noise = block.noise.begin() + static_cast<std::ptrdiff_t>(k * m);
  beginning_.rows.push_back(block.rows[k]);
  beginning_.values.insert(beginning_.values.end(), values,
                           values + static_cast<std::ptrdiff_t>(width));
  beginning_.noise.insert(beginning_.noise.end(), noise, noise + static_cast<std::ptrdiff_t>(m));
}

double RecordSummary::NoiseToSignal() const {
  double least = 1;
  for (const Channel& channel : channels_) {
    if (channel.largest > 0) {
      least = std::min(least, channel.RootMeanSquareNoise() / channel.largest);
    }
  }
  return least;
}

int64_t RecordSummary::samples() const {
  int64_t total = 0;
  for (const Channel& channel : channels_) total += channel.samples;
  return total;
}

}  // namespace polyest
