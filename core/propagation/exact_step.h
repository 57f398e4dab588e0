#pragma once

// A step of the length h of a linear system x' = A x + D w, w' = J w (linear_system.h) without
// error of integration, for a block of points:
//
//   x(t + h) = x + E x + W w,  w(t + h) = w + G w,   [I + E, W; 0, I + G] = exp(h [A, D; 0, J]).
//
// E = e^{hA} − I is kept rather than e^{hA}: where a step is short beside the motion its rounding
// errors, which all steps share, are smaller by h‖A‖.
//
// Taylor's series gives the matrices for h · rate ≤ 1; all its terms are at most 1 then. Longer
// steps are doubled from there: e^{2hA} − I = 2E + E². Rounding errors of the coefficients and of
// the doublings grow with h · rate, as they do in any method: relative to the states they are some
// 1e-16 · max(1, h · rate). Source: C. Moler and C. Van Loan, Nineteen Dubious Ways to Compute the
// Exponential of a Matrix, SIAM Review 45 (2003), methods 1 and 3.

#include <Eigen/Core>

#include "core/common/types.h"
#include "core/propagation/linear_system.h"

namespace polyest::internal {

struct ExactStep {
  double length_s = 0;
  Eigen::ArrayXXd matrices;  // [E W], laid out as LinearSystem::coefficients
  Matrix G;
};

// Returns the step of any length ≥ 0.
ExactStep MakeExactStep(const LinearSystem& system, double length_s);
// Returns the step of twice the length.
ExactStep Doubled(const LinearSystem& system, const ExactStep& step);

// The memory that a step works in.
struct StepMemory {
  explicit StepMemory(const LinearSystem& system)
      : term(system.coefficients.rows(), system.states),
        product(term),
        w_term(system.components),
        w_product(system.components) {}

  Eigen::ArrayXXd term, product;  // rows × states
  Vector w_term, w_product;
};

// Advances the states (rows × states) and w by the step.
void Apply(const LinearSystem& system, const ExactStep& step, Eigen::ArrayXXd& states, Vector& w,
           StepMemory& memory);
// Returns how many terms of Taylor's series a step needs that has |length| · rate ≤ 1.
int SeriesTerms(const LinearSystem& system, double length_s);
// Advances them by the first `terms` terms of the series, each a product with A. The length may be
// negative.
void ApplySeries(const LinearSystem& system, double length_s, int terms, Eigen::ArrayXXd& states,
                 Vector& w, StepMemory& memory);

}  // namespace polyest::internal
