#pragma once

// The other minima of a cost that a user should know of.

#include <vector>

#include "core/bayes/cost.h"
#include "core/bayes/minimizer.h"
#include "core/bayes/prior.h"
#include "core/estimator/expansion/expansion_design.h"

namespace polyest::internal {

// Returns the parameters θ at those of the distinct `minima` (lowest first) that have a cost
// comparable with the first one's, are isolated, and lie behind a ridge of the cost, to which no
// valley leads around. A stop request leaves those in which it is not known whether one does.
std::vector<Vector> OtherMinima(const Cost& cost, const ExpansionDesign& design, const Prior& prior,
                                const std::vector<Minimum>& minima, const Stop& stop);

}  // namespace polyest::internal
