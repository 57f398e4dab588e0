#pragma once

// The state of an expansion that has been moved to another region (carry_over.h).

#include <absl/status/statusor.h>

#include "core/estimator/expansion/expansion_state.h"
#include "polyest/stop.h"

namespace polyest::internal {

// Returns the part of an ensemble's state that can be interpolated between its points: the states
// of trajectories, or the means of filters and the factors of their covariances (points × numbers).
// Interpolated factors are those of a covariance, too.
Matrix InterpolableStates(const ResolvedProblem& problem, const EnsembleState& ensemble);
// Returns the state of an ensemble like `ensemble` whose points have these values instead.
EnsembleState WithInterpolated(const ResolvedProblem& problem, const EnsembleState& ensemble,
                               const ConstMatrixRef& values);

// Returns the state that an expansion of the design has after the rows of the state `kept`, which
// is one of `present`: the sums by its own terms, and trajectories in states interpolated between
// those of the collocation points. `error` is Σ ρ/R of the sums in the new region. Returns
// InfeasibleError if a collocation matrix cannot be factored or the new expansion has control
// trajectories and the present one none; on a stop request its status.
absl::StatusOr<ExpansionState> CarriedState(const ResolvedProblem& problem,
                                            const RegionalExpansion& present,
                                            const ExpansionState& kept,
                                            const ExpansionDesign& design, double error,
                                            const Stop& stop);

}  // namespace polyest::internal
