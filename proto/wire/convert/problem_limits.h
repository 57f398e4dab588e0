#pragma once

// How large a problem may be that a daemon takes; past a limit RESOURCE_EXHAUSTED names it.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <limits>

#include "core/estimator/problem/resolved_problem.h"
#include "core/fmu/model_library.h"
#include "polyest/v1/measurements.pb.h"
#include "polyest/v1/problem.pb.h"

namespace polyest::internal {

// By default what the core itself can bear.
struct ProblemLimits {
  int64_t parameters = kMaxTerms;  // --max-parameters: uncertain, those of all runs together
  int64_t states = std::numeric_limits<int64_t>::max();  // --max-states: of the model
  // --max-points: collocation points at a time, of the highest order that the expansion may get.
  int64_t points = kMaxPoints;
};

absl::Status CheckLimits(const ProblemLimits& limits, const ResolvedProblem& problem);
// The same once a batch has been added, with whose runs there may come parameters; OK if there come
// none.
absl::Status CheckRuns(const ProblemLimits& limits, const ResolvedProblem& problem,
                       const v1::Measurements& batch);

// As ToProblem, within the limits.
absl::StatusOr<ResolvedProblem> ToProblem(const v1::Problem& problem, const ModelLibrary& models,
                                          const ProblemLimits& limits);

}  // namespace polyest::internal
