#pragma once

// Parameters that differ between the runs of a record, such as initial states, beside those that
// all runs share.

#include <absl/status/statusor.h>

#include <vector>

#include "core/bayes/prior.h"

namespace polyest::internal {

// Returns the uncertain parameters of a record of `runs` ≥ 1 runs: all parameters for run 0 in the
// order given, then the per-run parameters of run 1, of run 2, … The name of a per-run parameter
// includes the run: x_0[2].
std::vector<UncertainParameter> ParametersOfRuns(const std::vector<UncertainParameter>& given,
                                                 int runs);

// Returns the prior of those parameters. A correlation between per-run parameters holds within each
// run. Returns InvalidArgument as Prior::Make does, and for a correlation between a per-run and a
// shared parameter, which many runs could not all have.
absl::StatusOr<Prior> PriorOfRuns(const std::vector<UncertainParameter>& given,
                                  const std::vector<Correlation>& correlations, int runs);

}  // namespace polyest::internal
