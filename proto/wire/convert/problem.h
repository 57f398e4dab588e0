#pragma once

// A problem off the wire, or out of a problem file, as the core understands it.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "core/fmu/model_library.h"
#include "polyest/v1/problem.pb.h"

namespace polyest::internal {

// Fields left out take the defaults that problem.proto names. A message on failure starts with the
// field's path in the problem file, as in "uncertain[0].uniform: lower 5 must be below upper 3".
// A built-in model or an FMU is looked for in `models`.
absl::StatusOr<ResolvedProblem> ToProblem(const v1::Problem& problem,
                                          const ModelLibrary& models = {});

// All that ToProblem has to say against it, not only the first; when the model cannot be had, what
// can be said without it. Empty: nothing.
std::vector<absl::Status> CheckProblem(const v1::Problem& problem, const ModelLibrary& models = {});

}  // namespace polyest::internal
