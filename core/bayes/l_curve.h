#pragma once

// The L-curve (Hansen 1992), which chooses the regularization weight α² of (56): the corner of the
// curve of the prior term against the mismatch, both on logarithmic axes. Beyond the corner more
// weight increases the mismatch, and less weight the distance from the prior's mode.
//
// α² runs over the values of RangeOfChoice(). The corner is the value of greatest curvature of
//   ( log J_mismatch, log (J_apriori − min J_apriori) )
// where the curve bends as an L does and has both legs: below the corner the prior term at least
// doubles, above it the mismatch does. Values at which either term is mere rounding (10⁻¹⁰ of its
// largest) are left out. There is no corner if the data determine everything or can be fitted
// exactly, as in §3.4 without noise.

#include <vector>

#include "core/bayes/prior.h"
#include "core/bayes/regularization.h"

namespace polyest::internal {

// Chooses among `minima`, the sweep over RangeOfChoice().
RegularizationChoice ChooseByLCurve(const std::vector<RegularizedMinimum>& minima,
                                    const Prior& prior);

}  // namespace polyest::internal
