#pragma once

// Whether the posterior leans on an edge of the expansion's region that is not an edge of its
// element: then it goes on where the expansion is not trusted, however accurate it is inside.

#include "core/bayes/cost.h"
#include "core/estimator/expansion/expansion_design.h"

namespace polyest::internal {

// Returns whether the Gaussian of the cost's curvature at its minimum, found from `start` (local
// coordinates), has more than 1.4 % of its mass beyond an edge (a
// little more than LeaningAxes asks of particles, so that it finds them when it is asked). Takes
// one minimization and no draws. Also true if the curvature there is not positive definite.
bool MayLean(const Cost& cost, const ExpansionDesign& design, const Vector& start);

}  // namespace polyest::internal
