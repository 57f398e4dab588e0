#pragma once

// The posterior density and the likelihood on the expansion at given parameters
// (polyest/log_density.h).

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "core/bayes/cost.h"
#include "polyest/log_density.h"

namespace polyest::internal {

// The cost of one component of the posterior, and where it is to be believed.
struct TrustedCost {
  Cost cost;
  Vector lower, upper;  // the box of the search for minima, in the coordinates of the expansion
  double height = 0;    // J + height is comparable among components
};

// What densities are computed from: a function of the samples alone.
struct DensityBasis {
  std::vector<TrustedCost> components;  // one or more
  std::vector<std::string> units;       // of the parameters
  std::vector<Diagnostic> diagnostics;
};

// Returns InvalidArgument or ResourceExhausted that names the field, the value and the rule if the
// options are invalid for parameters of these names.
absl::Status Validate(const LogDensityOptions& options, const std::vector<std::string>& names);

// Computes the densities. `options` must be valid. Returns InvalidArgument that names the point
// where one has no value: outside of the prior's support, or too far from the posterior for any
// component. Where several components have a value, that of the highest density counts.
absl::StatusOr<LogDensity> EvaluateLogDensity(const DensityBasis& basis,
                                              const LogDensityOptions& options);

}  // namespace polyest::internal
