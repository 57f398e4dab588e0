#pragma once

// Which parameter the model is least linear in over an expansion's region, found by trajectories
// along lines in which one germ varies alone.
//
// Along a line in a germ that the outputs are linear in, χ² is a quadratic. What the best quadratic
// leaves of χ² is therefore due to the others, whatever their number: unlike the terms of an
// expansion that does not follow the model, it is not spread over those that are linear.

#include <absl/status/statusor.h>

#include <optional>

#include "core/estimator/expansion/regional_expansion.h"
#include "polyest/stop.h"

namespace polyest::internal {

struct LeastLinear {
  std::optional<Eigen::Index> germ;  // nothing if the outputs are linear along all lines
  int64_t propagated_rows = 0;       // trajectories times rows
};

// Propagates the first `rows` rows of the store, which the expansion has absorbed, along four lines
// for each germ, of six points each. Returns an error only on a stop request.
absl::StatusOr<LeastLinear> FindLeastLinear(const ResolvedProblem& problem,
                                            const RegionalExpansion& expansion,
                                            const SampleStore& store, int64_t rows, int threads,
                                            const Stop& stop);

}  // namespace polyest::internal
