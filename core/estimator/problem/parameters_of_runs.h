#pragma once

// Parameters that each run of the record has for itself, such as its initial states, beside those
// that all runs share.

#include <absl/status/statusor.h>

#include <vector>

#include "core/bayes/prior.h"

namespace polyest::internal {

// The uncertain parameters of a record of `runs` ≥ 1 runs: all of run 0 in the order given, then
// those per run of run 1, of run 2, … One per run has its run's number in its name: x_0[2].
std::vector<UncertainParameter> ParametersOfRuns(const std::vector<UncertainParameter>& given,
                                                 int runs);

// Their prior; a correlation between parameters per run holds within each run. INVALID_ARGUMENT as
// Prior::Make, and for a correlation with a shared parameter: so many runs could not all have it.
absl::StatusOr<Prior> PriorOfRuns(const std::vector<UncertainParameter>& given,
                                  const std::vector<Correlation>& correlations, int runs);

}  // namespace polyest::internal
