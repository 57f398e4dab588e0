#include "core/estimator/posterior/independent_share.h"

#include <cmath>

namespace polyest::internal {

double IndependentShare(const RowBlock& beginning, int channel, const NoiseShape& noise) {
  if (beginning.rows.empty()) return 1;
  const size_t m = beginning.noise.size() / beginning.rows.size();
  double sum = 0, before_s = 0;
  int samples = 0;
  for (size_t k = 0; k < beginning.rows.size(); ++k) {
    if (beginning.noise[k * m + static_cast<size_t>(channel)] <= 0) continue;  // no sample
    const double decay = (beginning.rows[k].time_s - before_s) / noise.time_constant_s;
    // (1 − e^−x)/(1 + e^−x) = tanh ½x
    if (samples++ > 0) sum += std::tanh(0.5 * decay);
    before_s = beginning.rows[k].time_s;
  }
  if (samples <= 1) return 1;
  const double share = sum / (samples - 1);
  return share / (noise.white_share * share + 1 - noise.white_share);
}

}  // namespace polyest::internal
