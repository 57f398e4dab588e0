#pragma once

// Propagates the prior to the outputs over time, equations (3) to (13), for a resolved problem.

#include <absl/status/statusor.h>

#include "core/estimator/problem/resolved_problem.h"
#include "polyest/prior_propagation.h"

namespace polyest::internal {

// Does the work of polyest::PropagatePrior (polyest/prior_propagation.h) and returns its errors,
// except those of resolving the problem.
absl::StatusOr<Propagation> PropagatePrior(const ResolvedProblem& problem,
                                           const PropagationOptions& options, const Stop& stop);

}  // namespace polyest::internal
