#pragma once

// Tells what interpolating states between trajectories costs (carry_over.h). The check points of an
// expansion, which no polynomial was fitted to, are propagated over rows that follow a state of it,
// each from its own state there and from the one that the polynomials give.

#include <absl/status/statusor.h>

#include <cstdint>

#include "core/estimator/expansion/expansion_state.h"

namespace polyest::internal {

struct PairComparison {
  // The largest mean square over the check points, of all samples, of the difference of two outputs
  // in units of the noise. With filters it is that of the whitened innovations and half of that of
  // the log variances, of which a sample tells half as much.
  double mean_square = 0;
  int64_t propagated = 0;  // trajectories × rows
};

// Compares over the samples of the run of `kept`, a state of `present` inside a run, up to the
// first `rows` rows of the store. Returns InfeasibleError where trajectories fail.
absl::StatusOr<PairComparison> ComparePairs(const ResolvedProblem& problem,
                                            const RegionalExpansion& present,
                                            const ExpansionState& kept, const SampleStore& store,
                                            int64_t rows, int threads, const Stop& stop);

}  // namespace polyest::internal
