#include "core/estimator/record/learned_noise.h"

namespace polyest::internal {

LearnedNoise NoiseToBeginWith(const Problem& problem) {
  LearnedNoise noise;
  for (const MeasuredOutput& measured : problem.measured) {
    ChannelNoise channel;
    channel.time_constant_s = measured.noise.time_constant_s;
    channel.white_share = measured.noise.white_share;
    noise.channels.push_back(channel);
  }
  return noise;
}

}  // namespace polyest::internal
