#include "core/estimator/record/whitening.h"

#include <cmath>
#include <utility>

#include "core/common/check.h"

namespace polyest::internal {

Whitening::Whitening(const std::vector<ChannelNoise>& noise, Eigen::Index trajectories) {
  for (const ChannelNoise& of_channel : noise) {
    Channel channel;
    channel.scale = of_channel.scale;
    channel.time_constant_s = of_channel.time_constant_s;
    channel.white_share = of_channel.white_share;
    channel.previous.output = Vector::Zero(trajectories);
    channel.scratch.resize(trajectories);
    channels_.push_back(std::move(channel));
  }
}

void Whitening::BeginRun() {
  for (Channel& channel : channels_) channel.previous.known = false;
}

void Whitening::Apply(int first, int count, RowBlock& block, MatrixRef outputs) {
  const size_t width = block.width();
  const size_t m = channels_.size();
  const auto begin = static_cast<size_t>(first);
  for (size_t k = begin; k < begin + static_cast<size_t>(count); ++k) {
    for (size_t c = 0; c < m; ++c) {
      double& noise = block.noise[k * m + c];
      if (noise <= 0) continue;  // no sample
      noise *= channels_[c].scale;
      if (channels_[c].time_constant_s <= 0) continue;
      Whiten(channels_[c], block.rows[k].time_s, block.values[k * width + c], noise,
             outputs.col(static_cast<Eigen::Index>((k - begin) * m + c)));
    }
  }
}

void Whitening::Whiten(Channel& channel, double time_s, double& value, double& noise,
                       VectorRef output) {
  const double raw_value = value, raw_noise = noise;
  const double share = channel.white_share;  // f
  double variance = 1 - share;               // P⁻
  channel.scratch = output;
  PreviousSample& previous = channel.previous;
  if (previous.known) {
    const double decay = (time_s - previous.time_s) / channel.time_constant_s;
    const double a = std::exp(-decay);
    const double g = a * noise / previous.noise;
    value -= g * previous.value;
    output -= g * previous.output;
    variance = a * a * previous.variance - std::expm1(-2 * decay) * (1 - share);
  }
  const double innovation = variance + share;  // S
  const double kept = share / innovation;
  noise *= std::sqrt(innovation);
  previous.known = true;
  previous.time_s = time_s;
  previous.value = raw_value - kept * value;
  previous.noise = raw_noise;
  previous.variance = variance * kept;
  previous.output = channel.scratch - kept * output;
}

std::vector<PreviousSample> Whitening::State() const {
  std::vector<PreviousSample> state;
  for (const Channel& channel : channels_) state.push_back(channel.previous);
  return state;
}

void Whitening::Restore(std::vector<PreviousSample> state) {
  POLYEST_CHECK(state.size() == channels_.size());
  for (size_t c = 0; c < channels_.size(); ++c) {
    POLYEST_CHECK(state[c].output.size() == channels_[c].previous.output.size());
    channels_[c].previous = std::move(state[c]);
  }
}

}  // namespace polyest::internal
