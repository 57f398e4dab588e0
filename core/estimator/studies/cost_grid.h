#pragma once

// J_mismatch, J_apriori and J_total, equations (25) and (56), over one or two uncertain parameters
// of a resolved problem. Noise of unknown size or correlation is marginalized as in
// bayes/mismatch.h.

#include <absl/status/statusor.h>

#include "core/estimator/problem/resolved_problem.h"
#include "polyest/cost_grid.h"

namespace polyest::internal {

// Does the work of polyest::EvaluateCostGrid (polyest/cost_grid.h) and returns its errors, except
// those of resolving the problem.
absl::StatusOr<CostGrid> EvaluateCostGrid(const ResolvedProblem& problem, const Samples& samples,
                                          const CostGridOptions& options, const Stop& stop);

}  // namespace polyest::internal
