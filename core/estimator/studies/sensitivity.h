#pragma once

// Computes Sobol' indices of the outputs over the prior, for a resolved problem.

#include <absl/status/statusor.h>

#include "core/estimator/problem/resolved_problem.h"
#include "polyest/sensitivity.h"

namespace polyest::internal {

// Does the work of polyest::AnalyzeSensitivity (polyest/sensitivity.h) and returns its errors,
// except those of resolving the problem.
absl::StatusOr<SensitivityAnalysis> AnalyzeSensitivity(const ResolvedProblem& problem,
                                                       const SensitivityOptions& options,
                                                       const Stop& stop);

}  // namespace polyest::internal
