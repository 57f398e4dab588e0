#pragma once

// Tells how far the states of a model move during a record.

#include <absl/status/statusor.h>

#include <vector>

#include "client/cli/backend.h"
#include "client/cli/remedy.h"
#include "polyest/v1/study_service.pb.h"

namespace polyest::internal {

// Returns the states whose spread is known, in the model's order: the standard deviation of the
// trajectory that the posterior predicts along the record. A state that the model does not output
// has the spread of the outputs with its unit, or that of their rates of change; it is left out
// where there are none. `experiment` must be one whose posterior can be computed.
absl::StatusOr<std::vector<StateSpread>> SpreadsOfStates(v1::Experiment experiment,
                                                         Backend& backend);

}  // namespace polyest::internal
