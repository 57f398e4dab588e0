#pragma once

// Chooses the minimum of the cost that is the estimate. The error of an expansion may make a
// minimum where the model has none, far from the check points, at which the expansion has been
// compared with the model. The posterior's draws show such a minimum, too: hardly any of them are
// around it.

#include <cstddef>
#include <vector>

#include "core/bayes/cost.h"
#include "core/bayes/minimizer.h"
#include "core/estimator/expansion/expansion_design.h"
#include "core/estimator/posterior/posterior_draws.h"
#include "polyest/types.h"

namespace polyest::internal {

// Returns the index of the lowest minimum whose surroundings hold a twentieth or more of
// the posterior's draws (etas, draws × n, with `weights`, Σ = 1) or one of the check points (C ×
// n), in the same coordinates. The surroundings are the points η with (η − η_k)ᵀ H_k⁺ (η − η_k) ≤
// (√n + 2)², where H_k⁺ is the Hessian of the cost at the minimum η_k without its negative
// curvatures: along these the surroundings are unbounded. Returns 0, the lowest of all, if no other
// minimum of comparable cost has such surroundings. `minima` are sorted by cost and not empty;
// `hessians` (n × n) are in their order.
size_t BelievedMinimum(const std::vector<Minimum>& minima, const std::vector<Matrix>& hessians,
                       const ConstMatrixRef& checks, const ConstMatrixRef& etas,
                       const ConstVectorRef& weights);

// Puts the believed one in front of the other minima of the draws' posterior, which is that of the
// cost on an expansion of this design.
void BeginWithBelieved(const Cost& cost, const ExpansionDesign& design, PosteriorDraws& posterior);

}  // namespace polyest::internal
