#pragma once

// One sample of a channel as it enters the sums of an expansion (regional_expansion.h).

#include "polyest/noise.h"

namespace polyest::internal {

struct WeightedSample {
  int row = 0, channel = 0;
  int column = 0;  // of the block, FittedBlock::Column
  const NoiseModel* model = nullptr;
  // What weighs its outliers; none where filters do.
  OutlierHandling outliers = OutlierHandling::kNone;
  double value = 0;      // z; of noise that is relative to the prediction, the scored one
  double sigma = 0;      // standard deviation of its noise, without the weight
  double own_error = 0;  // ρ, the variance of the expansion's own error, divided by the misfit
  // From the posterior's centre, in units of its possible error there; 0 without outliers.
  double deviation = 0;
  double noise = 0;  // σ²/w: the variance of its noise with its weight as an outlier
  double lack = 0;   // what that weight leaves out of the negative log likelihood

  double variance() const { return noise + own_error; }  // R
};

}  // namespace polyest::internal
