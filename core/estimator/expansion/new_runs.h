#pragma once

// Extends an expansion when a run with its own parameters begins. It stays where it was in the
// known dimensions and covers the whole prior in the new ones.

#include <absl/status/statusor.h>

#include "core/estimator/expansion/expansion_design.h"
#include "core/estimator/problem/resolved_problem.h"
#include "core/estimator/record/learned_noise.h"

namespace polyest::internal {

// Returns the design for `grown`, the problem of the present design for more runs. Errors are those
// of DesignForPrior.
absl::StatusOr<ExpansionDesign> DesignForNewRuns(const ResolvedProblem& grown,
                                                 const ExpansionDesign& present);

// Returns the present particles (germ coordinates, W × n), extended by draws of the prior in the
// new dimensions.
Matrix ParticlesForNewRuns(const ResolvedProblem& grown, const Matrix& present);

// Returns the present summary, extended by the prior's mean and spread in the new dimensions. A
// posterior that is not known stays unknown.
PosteriorSummary SummaryForNewRuns(const ResolvedProblem& grown, const PosteriorSummary& present);

// Returns W draws of the posterior of the shared germs, a Gaussian, and of the prior of the own
// ones of the run that `problem` is for (W × n), and −log of their density up to a constant.
Particles DrawsForNewRun(const ResolvedProblem& problem, const Vector& centre, const Matrix& factor,
                         int count);

// Returns the design for a run that begins when all earlier ones have been eliminated. It covers 4½
// standard deviations of the shared germs, of which `centre` and `factor` (factor factorᵀ is the
// covariance) are the posterior, and the whole prior of the run's own.
ExpansionDesign DesignAfterEndedRuns(const ResolvedProblem& problem, const Vector& centre,
                                     const Matrix& factor, const Element& present);

// Returns the posterior when such a run begins.
PosteriorSummary SummaryAfterEndedRuns(const ResolvedProblem& problem, const Vector& centre,
                                       const Matrix& factor);

}  // namespace polyest::internal
