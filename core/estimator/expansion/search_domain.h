#pragma once

// The search domain for minima of the cost: the box in which the expansion is trusted (with its
// overshoot), intersected with Ω and the part of it in which the cost is defined.

#include "core/bayes/cost.h"
#include "core/bayes/minimizer.h"
#include "core/estimator/expansion/expansion_design.h"

namespace polyest::internal {

// Returns the minimization problem of the cost on the design's expansion, in local coordinates.
// `cost` must outlive it.
MinimizationProblem SearchOf(const Cost& cost, const ExpansionDesign& design);

// Returns `count` rows of `points` (W × n, W ≥ 1): first the one of least cost, then each time the
// one farthest from those already chosen, measured in standard deviations of the points.
Matrix SpreadStarts(const Matrix& points, const Vector& costs, int count);

}  // namespace polyest::internal
