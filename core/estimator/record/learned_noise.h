#pragma once

// The noise as learned from the record so far. Samples are weighed with it, so
// when it changes, the sums must be taken again.

#include <vector>

#include "core/common/types.h"
#include "core/estimator/record/correlation_profile.h"
#include "polyest/problem.h"

namespace polyest::internal {

struct ChannelNoise {
  double scale = 1;            // σ in units of NoiseModel::StandardDeviation
  double time_constant_s = 0;  // correlation time; 0 for white noise
  // Whether the unknown parts have been learned. Until then an unknown scale is as large as the
  // signal and treated as known, which overestimates the uncertainty.
  bool learned = false;
  // Whether the part of the noise that is relative to a value is taken of the prediction at
  // LearnedNoise::centre. It is taken of the sample until there is a prediction.
  bool of_prediction = false;
  double white_share = 0;  // of σ², uncorrelated; 0 ≤ … < 1, and 0 for white noise, too
  TimeConstantGrid grid =
      {};  // from which an unknown time constant is chosen; empty if none is yet

  NoiseShape shape() const { return {time_constant_s, white_share}; }
};

// The position and spread of the posterior at the last revision; outliers are judged by their
// residuals there.
struct PosteriorSummary {
  Vector centre;  // ξ (n); empty if not known yet
  Matrix factor;  // F Fᵀ = covariance of ξ, n × n
};

struct LearnedNoise {
  // Returns this noise for another expansion.
  LearnedNoise ForNewExpansion() const {
    LearnedNoise noise = *this;
    noise.misfit_of_weights = misfit;
    return noise;
  }

  std::vector<ChannelNoise> channels;
  PosteriorSummary posterior;
  // Mean square of the residuals ÷ that of the stated noise where the residuals contradict it
  // (misfit.h), else 1. The cost is divided by it.
  double misfit = 1;
  // The misfit when the expansion was made, by which its own error is divided. It stays the same,
  // so that all rows are weighed alike.
  double misfit_of_weights = 1;
  // ξ at which noise is predicted and about which residuals are linearized (n); that of the
  // expansion's reference if empty.
  Vector centre;
};

// Returns the initial noise: unknown scales are not learned yet, and correlations are as given.
LearnedNoise NoiseToBeginWith(const Problem& problem);

}  // namespace polyest::internal
