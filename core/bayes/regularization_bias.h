#pragma once

// The bias that a weight α² ≠ 1 of the prior term brings: the distance θ̂(α²) − θ̂(1) of the
// estimate from that of Bayes' rule, in the parameters' units. More weight moves it towards the
// prior's most likely value, less away from it.
//
// The bias is counted from α² = 1 and not from the minimum of the mismatch: in a direction that the
// data do not inform the mismatch has no minimum, and the effect of the prior at its own weight is
// knowledge and not a bias.
//
// ξ̂(1) is the minimum of J with α² = 1, with the mismatch replaced by its second-order expansion
// about ξ̂ = ξ̂(α²) (concave directions count as flat) and the prior term unchanged:
//   ξ̂(1) = argmin_Ω  g·(ξ − ξ̂) + ½ (ξ − ξ̂)ᵀ H_mismatch (ξ − ξ̂) + J_apriori(ξ),
// g = −α² ∇J_apriori(ξ̂) is the mismatch's gradient at the minimum (computed directly where ξ̂ lies
// at a bound of Ω, because the gradient of J need not vanish there). The result is exact for
// outputs linear in the germs; for others it avoids evaluating the expansion where it is not
// trusted. A flat direction has no bias.

#include "core/bayes/cost.h"
#include "polyest/stop.h"

namespace polyest::internal {

// Returns the bias (n); 0 for α² = 1. `eta` is the minimum of the cost in local coordinates.
Vector RegularizationBias(const Cost& cost, const ConstVectorRef& eta, const Stop& stop);

}  // namespace polyest::internal
