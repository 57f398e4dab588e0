#pragma once

// Limits the size of the problems that a daemon accepts. An error beyond a limit is
// RESOURCE_EXHAUSTED and names the limit.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <limits>

#include "core/estimator/problem/resolved_problem.h"
#include "core/external/model_library.h"
#include "polyest/v1/measurements.pb.h"
#include "polyest/v1/problem.pb.h"

namespace polyest::internal {

// The defaults are the limits of the core itself.
struct ProblemLimits {
  int64_t parameters = kMaxTerms;  // --max-parameters: uncertain parameters of all runs together
  int64_t states = std::numeric_limits<int64_t>::max();  // --max-states: states of the model
  // --max-points: collocation points in use at a time, up to the highest order of the expansion.
  int64_t points = kMaxPoints;
};

// Refuses a problem that exceeds a limit.
absl::Status CheckLimits(const ProblemLimits& limits, const ResolvedProblem& problem);
// Refuses a batch whose runs add so many parameters of their own that the problem exceeds a limit.
// Returns OK when the batch adds no parameters or when its run numbers are invalid, which the
// estimator reports.
absl::Status CheckRuns(const ProblemLimits& limits, const ResolvedProblem& problem,
                       const v1::Measurements& batch);

// Converts a problem as ToProblem in problem.h does, and refuses it when it exceeds a limit.
absl::StatusOr<ResolvedProblem> ToProblem(const v1::Problem& problem, const ModelLibrary& models,
                                          const ProblemLimits& limits);

}  // namespace polyest::internal
