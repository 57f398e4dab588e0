#pragma once

#include <absl/status/statusor.h>

#include <cstdint>

#include "core/estimator/problem/resolved_problem.h"
#include "polyest/stop.h"
#include "polyest/v1/measurements.pb.h"
#include "server/sessions/session.h"

namespace polyest::internal {

// Adds the rows of a session, whose problem is given, to `measurements`, in time order and in the
// units of the model; leaves out rows that wait for others that may come before them, and those
// that `cuts` leave out. Returns the number of the last batch. Errors are those of
// Session::ReadBatches and of the stop, and RESOURCE_EXHAUSTED where the tenant may not hold so
// many rows in memory.
absl::StatusOr<int64_t> ReadRows(const Session& session, const ResolvedProblem& problem,
                                 const RunCuts& cuts, const Stop& stop,
                                 v1::Measurements& measurements);

}  // namespace polyest::internal
