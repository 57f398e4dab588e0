#pragma once

// Choice of the regularization weight α² of (56) by the L-curve (Hansen 1992): the corner of the
// curve of the prior term against the mismatch, both on logarithmic axes, where more weight begins
// to cost mismatch and less weight begins to cost distance from the prior's most likely value.
//
// α² runs over the values of RangeOfChoice(). The corner is the value of greatest curvature of
//   ( log J_mismatch, log (J_apriori − min J_apriori) )
// that bends as an L does and has both its legs: below it the prior term at least doubles, above
// it the mismatch does. Values at which either term is no more than rounding (10⁻¹⁰ of its
// largest) are left out. There is no corner where the data determine everything or can be met
// exactly, as in §3.4 without noise.

#include <vector>

#include "core/bayes/prior.h"
#include "core/bayes/regularization.h"

namespace polyest {

// `minima`: the sweep over RangeOfChoice(), one of which is chosen.
RegularizationChoice ChooseByLCurve(const std::vector<RegularizedMinimum>& minima,
                                    const Prior& prior);

}  // namespace polyest
