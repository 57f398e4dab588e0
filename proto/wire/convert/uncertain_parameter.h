#pragma once

// Converts what a problem says of an uncertain parameter.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <optional>
#include <vector>

#include "polyest/uncertain_parameter.h"
#include "polyest/v1/problem.pb.h"

namespace polyest::internal {

// Returns the parameter with its prior alone. Errors are INVALID_ARGUMENT.
absl::StatusOr<UncertainParameter> ToPrior(const v1::UncertainParameter& parameter);

// Returns how the parameter changes with time; nothing if it does not. Returns INVALID_ARGUMENT for
// a drift of no kind.
absl::StatusOr<std::optional<RandomWalk>> ToDrift(const v1::UncertainParameter& parameter);

// Returns an error for each uncertain parameter whose name is also that of another one in a run:
// "k[1]" beside "k" with perRun, whose values are called k[0], k[1], … in an estimate.
std::vector<absl::Status> CheckNamesOfRuns(const v1::Problem& problem);

}  // namespace polyest::internal
