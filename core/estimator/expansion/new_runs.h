#pragma once

// What an expansion that has followed the record so far becomes when a run begins that has
// parameters of its own: the same where it was, the whole prior in the new dimensions.

#include <absl/status/statusor.h>

#include "core/estimator/expansion/expansion_design.h"
#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/learned_noise.h"

namespace polyest::internal {

// `grown` is the problem of the present design, for more runs. FAILED_PRECONDITION and
// RESOURCE_EXHAUSTED as DesignForPrior.
absl::StatusOr<ExpansionDesign> DesignForNewRuns(const ResolvedProblem& grown,
                                                 const ExpansionDesign& present);

// `present` particles (germ coordinates, W × n), with draws of the prior in the new dimensions.
Matrix ParticlesForNewRuns(const ResolvedProblem& grown, const Matrix& present);

// Where the posterior is known, with the prior's mean and spread in the new dimensions.
PosteriorSummary SummaryForNewRuns(const ResolvedProblem& grown, const PosteriorSummary& present);

}  // namespace polyest::internal
