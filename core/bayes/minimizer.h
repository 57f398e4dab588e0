#pragma once

// Minimization of a smooth function in a box with linear inequality constraints, from several
// starts. This is the only wrapper of NLopt (SLSQP); it maps every return code and exception.

#include <functional>
#include <string>
#include <vector>

#include "core/common/types.h"
#include "polyest/stop.h"

namespace polyest::internal {

struct MinimizationProblem {
  // Returns the value at x and fills `gradient` if it is not null. May return +∞ (outside Ω).
  std::function<double(const Vector& x, Vector* gradient)> function;
  Vector lower;  // of x; finite
  Vector upper;
  Matrix constraint;  // rows a with aᵀx ≤ bound; may have no rows
  Vector bound;
  // Number of threads that search at a time, ≥ 1, each from a start of its own and all by
  // `function`. Results do not depend on it.
  int threads = 1;
};

struct MinimizerOptions {
  double relative_step = 1e-10;  // ends when every |Δx_i| ≤ relative_step × (upper_i − lower_i)
  int max_evaluations = 500;     // for each start
  // Two minima count as one if every |Δx_i| ≤ same_point × (upper_i − lower_i).
  double same_point = 1e-3;
};

struct Minimum {
  Vector point;
  double value = 0;
  bool converged = false;
  int code = 0;        // NLopt's return code; 0 where NLopt was not asked
  std::string reason;  // the code in words
  int evaluations = 0;
};

// Returns those of the minima that differ in their points, lowest first. One that has not converged
// is left out unless it is the lowest.
std::vector<Minimum> DistinctMinima(std::vector<Minimum> found, const MinimizationProblem& problem,
                                    const MinimizerOptions& options);

// Returns where SLSQP gets from `start`, moved inside, until its steps are within
// options.relative_step, or the start itself where that is lower. The point is usually near a
// minimum, but need not be one.
Vector DescendFrom(const MinimizationProblem& problem, const Vector& start,
                   const MinimizerOptions& options, const Stop& stop);

// Returns the distinct minima found from the starts (rows of `starts`), lowest first; at least one.
// A start outside the box or the constraints is moved inside. The result is deterministic. On a
// stop request returns the minima found so far with converged = false.
std::vector<Minimum> FindMinima(const MinimizationProblem& problem, const Matrix& starts,
                                const MinimizerOptions& options, const Stop& stop);

}  // namespace polyest::internal
