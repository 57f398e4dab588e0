#pragma once

// The bias that a weight α² ≠ 1 of the prior term brings: how far the estimate lies from the one
// that Bayes' rule asks for, θ̂(α²) − θ̂(1), in the parameters' units. More weight moves it towards
// the prior's most likely value, less away from it.
//
// α² = 1 and not the minimum of the mismatch is what it is counted from: in a direction that the
// data do not inform, the mismatch has no minimum, and what the prior at its own weight does there
// is not a bias but knowledge.
//
// ξ̂(1) is the minimum of J with α² = 1 where the mismatch is taken for its own second-order
// expansion about ξ̂ = ξ̂(α²) (concave directions as flat ones), the prior term as it is:
//   ξ̂(1) = argmin_Ω  g·(ξ − ξ̂) + ½ (ξ − ξ̂)ᵀ H_mismatch (ξ − ξ̂) + J_apriori(ξ),
// g = −α² ∇J_apriori(ξ̂) the mismatch's gradient at the minimum (its own where ξ̂ lies at a bound of
// Ω, where J's need not vanish). Exact for outputs linear in the germs, and where they are not it
// does not ask the expansion about places where it is not trusted. A flat direction has no bias.

#include "core/bayes/cost.h"
#include "core/common/stop.h"

namespace polyest {

// n; eta: the minimum of the cost, local coordinates. 0 for α² = 1.
Vector RegularizationBias(const Cost& cost, const ConstVectorRef& eta, const Stop& stop);

}  // namespace polyest
