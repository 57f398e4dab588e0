#pragma once

// The model's own outputs at draws of the uncertain parameters, and their slopes there. An
// expansion over a wide prior has other slopes wherever it does not follow the model, and tells
// parameters apart that the model cannot.

#include <absl/status/statusor.h>

#include <vector>

#include "core/common/types.h"
#include "core/estimator/expansion/prior_expansion.h"
#include "core/estimator/problem/resolved_problem.h"
#include "core/propagation/trajectory_ensemble.h"
#include "polyest/stop.h"

namespace polyest::internal {

// Output i of m at time k is row k·m + i.
struct OutputsAtDraw {
  Vector values;
  Matrix slopes;  // ∂y/∂ξ, a column for each germ
};

struct ModelAtDraws {
  Matrix xis;  // the draws whose trajectories could all be integrated, a row each
  std::vector<OutputsAtDraw> outputs;  // of each
  int trajectories = 0;
  std::vector<PointFailure> failures;
};

// Integrates, for each draw (a row of `xis`, germ coordinates), one trajectory through it and two
// for the central difference along each germ. Returns InvalidArgument naming `inputs` when an input
// is streamed, FailedPrecondition when no draw could be integrated, or the status of a stop
// request.
absl::StatusOr<ModelAtDraws> EvaluateAtDraws(const ResolvedProblem& problem,
                                             const std::vector<int>& outputs, const Matrix& xis,
                                             const TimeGrid& grid, int threads, const Stop& stop);

}  // namespace polyest::internal
