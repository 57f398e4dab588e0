#pragma once

// Choice of the regularization weight α² of (56) by the L-curve (Hansen 1992): the corner of the
// curve of the prior term against the mismatch, both on logarithmic axes, where more weight begins
// to cost mismatch and less weight begins to cost distance from the prior's most likely value.
//
// α² runs over 10⁻⁴ … 10⁴, four values a decade. The corner is the value of greatest curvature of
//   ( log J_mismatch, log (J_apriori − min J_apriori) )
// that bends as an L does and has both its legs: below it the prior term at least doubles, above
// it the mismatch does. Values at which either term is no more than rounding (10⁻¹⁰ of its
// largest) are left out. There is no corner where the data determine everything or can be met
// exactly, as in §3.4 without noise; then α² is 1, which is what Bayes' rule asks for.

#include <functional>
#include <vector>

#include "core/bayes/cost.h"
#include "core/bayes/prior.h"

namespace polyest {

struct LCurvePoint {
  double regularization = 0;  // α²
  CostValue cost;             // at the minimum for this α²
};

struct LCurve {
  std::vector<LCurvePoint> points;  // α² increasing
  double regularization = 1;        // at the corner; 1 when there is none
  bool corner_found = false;
};

// minimum: the cost at the minimum for a given α².
LCurve ChooseByLCurve(const std::function<CostValue(double regularization)>& minimum,
                      const Prior& prior);

}  // namespace polyest
