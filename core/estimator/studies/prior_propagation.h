#pragma once

// What the prior predicts of the outputs over time (3)–(13), for a resolved problem.

#include <absl/status/statusor.h>

#include "core/estimator/problem/resolved_problem.h"
#include "polyest/prior_propagation.h"

namespace polyest::internal {

absl::StatusOr<Propagation> PropagatePrior(const ResolvedProblem& problem,
                                           const PropagationOptions& options, const Stop& stop);

}  // namespace polyest::internal
