#pragma once

// Chooses the correlation of a channel's noise from the likelihoods of a profile
// (correlation_profile.h): white, correlated, or correlated with a white share.
//
//   Without a white share   the best time constant of the grid, by the parabola through it and its
//                           neighbours, if it gains 1 in log likelihood over white noise.
//   With one                the best of the grid, which is coarse, or, if the present noise has
//   one,
//                           the minimum of the quadratic function of log τ and log f/(1 − f)
//                           through the neighbours of the present noise. So it is refined from one
//                           revision to the next. It must gain 1 over the best without a share, and
//                           2 over white noise, which lacks both its parameters.

#include <limits>
#include <vector>

#include "core/estimator/record/correlation_profile.h"

namespace polyest::internal {

// A noise with the scale that goes with it.
struct NoiseChoice {
  NoiseShape noise;
  double scale = 1;  // in units of the working noise
  double negative_log_likelihood = std::numeric_limits<double>::infinity();
  int step = -1;  // of the grid, the nearest; −1 for white noise
};

// Returns the choice. `values` are those of the profile's members, in their order.
NoiseChoice ChooseNoise(const CorrelationProfile& profile, const std::vector<ProfileValue>& values,
                        const TimeConstantGrid& grid);

// Whether two noises differ by so little that the difference hardly changes the uncertainty: an
// estimate between the members of a profile is no more accurate than this.
bool IsAbout(const NoiseShape& a, const NoiseShape& b);

}  // namespace polyest::internal
