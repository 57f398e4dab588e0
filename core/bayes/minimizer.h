#pragma once

// Minimization of a smooth function in a box with linear inequality constraints, from several
// starts. The one wrapper of NLopt (SLSQP): every return code and exception is mapped.

#include <functional>
#include <string>
#include <vector>

#include "core/common/stop.h"
#include "core/common/types.h"

namespace polyest {

struct MinimizationProblem {
  // Value at x; fills gradient when it is not null. May return +∞ (outside Ω).
  std::function<double(const Vector& x, Vector* gradient)> function;
  Vector lower;  // of x; finite
  Vector upper;
  Matrix constraint;  // rows a with aᵀx ≤ bound; may have no rows
  Vector bound;
};

struct MinimizerOptions {
  double relative_step = 1e-10;  // stop when every |Δx_i| ≤ relative_step × (upper_i − lower_i)
  int most_evaluations = 500;    // a start
  // Two minima are the same when every |Δx_i| ≤ same_point × (upper_i − lower_i) …
  double same_point = 1e-3;
};

struct Minimum {
  Vector point;
  double value = 0;
  bool converged = false;
  int code = 0;        // NLopt's own
  std::string reason;  // in words
  int evaluations = 0;
};

// The distinct minima found from the starts (one a row), lowest first; at least one. A start
// outside the box or the constraints is moved inside. Deterministic. On a stop request returns
// what it has, converged = false.
std::vector<Minimum> FindMinima(const MinimizationProblem& problem, const Matrix& starts,
                                const MinimizerOptions& options, const Stop& stop);

}  // namespace polyest
