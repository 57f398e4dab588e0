#pragma once

// Parameters that differ between the runs of a record, such as initial states, beside those that
// all runs share.

#include <absl/status/statusor.h>

#include <vector>

#include "core/bayes/prior.h"

namespace polyest::internal {

// Returns the uncertain parameters of a record of `runs` ≥ 1 runs: all parameters for run 0 in the
// order given, then the per-run parameters of run 1, of run 2, … The name of a per-run parameter
// includes the run: x_0[2]. With `first_run` < `runs`, earlier runs are left out: then all
// parameters for that run come first.
std::vector<UncertainParameter> ParametersOfRuns(const std::vector<UncertainParameter>& given,
                                                 int runs, int first_run = 0);

// Returns the prior of those parameters. A correlation between per-run parameters holds within each
// run. Returns InvalidArgument as Prior::Make does, and for a correlation between a per-run and a
// shared parameter, which many runs could not all have.
absl::StatusOr<Prior> PriorOfRuns(const std::vector<UncertainParameter>& given,
                                  const std::vector<Correlation>& correlations, int runs,
                                  int first_run = 0);

}  // namespace polyest::internal
