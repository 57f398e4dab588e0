#pragma once

// Minima of the cost, by Newton's method where it leads to one. With the exact Hessian a few steps
// reach a minimum that has no active bound, where a search by gradients alone takes many, each of
// which costs O(n³) for n parameters with bounds.

#include <optional>
#include <vector>

#include "core/bayes/cost.h"
#include "core/bayes/minimizer.h"

namespace polyest::internal {

// Returns where Newton's method with backtracking leads from `start`; nothing if it leaves the box
// or the constraints, meets a Hessian that is not positive definite, or does not converge.
std::optional<Vector> MinimumByNewton(const Cost& cost, const MinimizationProblem& problem,
                                      const Vector& start);

// Returns starts (at most as many rows as `starts`, at least one if it has any; local coordinates)
// for FindMinima. A start from which Newton's method converges inside the box and the constraints
// of `problem`, whose function is the cost, is replaced by the point that it converges to, once for
// starts that lead to the same point. The others stay.
Matrix ImprovedStarts(const Cost& cost, const MinimizationProblem& problem, const Matrix& starts,
                      const MinimizerOptions& options);

// Returns what FindMinima finds from the improved starts, ≥ 1 row.
std::vector<Minimum> FindMinimaOf(const Cost& cost, const MinimizationProblem& problem,
                                  const Matrix& starts, const Stop& stop);

}  // namespace polyest::internal
