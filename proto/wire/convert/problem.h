#pragma once

// Converts a problem from its protobuf message, which a request or a problem file holds, to the
// problem of the core.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <memory>
#include <vector>

#include "core/estimator/problem/resolved_problem.h"
#include "core/external/model_library.h"
#include "polyest/v1/problem.pb.h"

namespace polyest::internal {

// Converts a problem and resolves it. Fields left out take the defaults that problem.proto names.
// An error message starts with the field's path in the problem file, as in
// "uncertain[0].uniform: lower 5 must be below upper 3". FMUs are looked up in `models`.
absl::StatusOr<ResolvedProblem> ToProblem(const v1::Problem& problem,
                                          const ModelLibrary& models = {});

// Returns all errors that ToProblem would find, not only the first; none for a valid problem. When
// the model is not available, returns the errors that can be found without it.
std::vector<absl::Status> CheckProblem(const v1::Problem& problem, const ModelLibrary& models = {});

// Returns whether the likelihood of a problem is that of prediction errors, also by default.
bool UsesFilters(const v1::Problem& problem);

// Returns the model of a problem; null if it is not available.
std::shared_ptr<const Model> FindModelOf(const v1::Problem& problem, const ModelLibrary& models);

}  // namespace polyest::internal
