#pragma once

// Minima of the cost, by Newton's method where it leads to one. With the exact Hessian a few steps
// reach a minimum, where a search by gradients alone takes many, each of which costs O(n³) for n
// parameters with bounds.

#include <optional>
#include <vector>

#include "core/bayes/cost.h"
#include "core/bayes/minimizer.h"

namespace polyest::internal {

// Returns the minimum, in the box and within the constraints of `problem`, to which Newton's method
// with backtracking and an active set leads from `start`; nothing if the start is outside by
// more than rounding, the Hessian in the directions that are free is not positive definite
// somewhere on the way, or the method does not converge.
std::optional<Vector> MinimumByNewton(const Cost& cost, const MinimizationProblem& problem,
                                      const Vector& start);

// Returns the distinct minima of the cost, which is the function of `problem`, in local
// coordinates, lowest first, at least one: those to which Newton's method leads from the starts
// (rows of `starts`) or from where a descent by gradients ends, and those that FindMinima finds
// from there otherwise. On a stop request returns those found so far.
std::vector<Minimum> FindMinimaOf(const Cost& cost, const MinimizationProblem& problem,
                                  const Matrix& starts, const Stop& stop);

}  // namespace polyest::internal
