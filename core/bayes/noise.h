#pragma once

#include <absl/status/status.h>

#include <algorithm>
#include <cmath>

namespace polyest {

// Standard deviation of the measurement noise of one sample z of a channel:
//   σ = max(10⁻⁶, absolute + relative·|z| + relative_to_max·max|z|),
// the maximum over the channel's samples up to and including this one in time order, so that how
// samples are cut into batches does not matter.
struct NoiseModel {
  double absolute = 0;         // in the output's unit
  double relative = 0;         // of |z|
  double relative_to_max = 0;  // of max |z|

  static constexpr double kLeastStandardDeviation = 1e-6;

  double StandardDeviation(double z, double largest_magnitude) const {
    return std::max(kLeastStandardDeviation,
                    absolute + relative * std::abs(z) + relative_to_max * largest_magnitude);
  }
};

}  // namespace polyest
