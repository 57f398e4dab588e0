#pragma once

// What the record has taught of the noise so far: what the samples are weighed with, so that a
// change of it asks for the sums to be taken anew.

#include <vector>

#include "core/common/types.h"

namespace polyest::internal {

struct ChannelNoise {
  double scale = 1;            // σ in units of NoiseModel::StandardDeviation
  double time_constant_s = 0;  // of the correlation; 0: white
  // Whether what is unknown of it has been learned. Until then an unknown scale is as large as the
  // signal, and taken as known: that errs on the side of too much uncertainty.
  bool learned = false;
};

// Where the posterior was last looked at, for the residuals that tell outliers from samples.
struct PosteriorSummary {
  Vector centre;  // ξ (n); empty: not looked at yet
  Matrix factor;  // F Fᵀ = covariance of ξ, n × n
};

struct LearnedNoise {
  std::vector<ChannelNoise> channels;
  PosteriorSummary posterior;
};

}  // namespace polyest::internal
