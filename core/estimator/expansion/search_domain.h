#pragma once

// Where minima of the cost are looked for: the box in which the expansion is trusted (with its
// overshoot), cut by Ω.

#include "core/bayes/cost.h"
#include "core/bayes/minimizer.h"
#include "core/estimator/expansion/expansion_design.h"

namespace polyest::internal {

// The minimization of the cost on the design's expansion, in local coordinates; `cost` must outlive
// it.
MinimizationProblem SearchOf(const Cost& cost, const ExpansionDesign& design);

// `count` rows of points (W × n, W ≥ 1): that of least cost, then each time the one farthest from
// those chosen, in standard deviations of the points.
Matrix SpreadStarts(const Matrix& points, const Vector& costs, int count);

}  // namespace polyest::internal
