#pragma once

// What the prior predicts for the outputs over time, before anything is measured.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <vector>

#include "polyest/density.h"
#include "polyest/integration_options.h"
#include "polyest/problem.h"
#include "polyest/stop.h"
#include "polyest/types.h"

namespace polyest {

// The most numbers in an answer: times × outputs × numbers for each; past it RESOURCE_EXHAUSTED.
inline constexpr int64_t kMaxPropagatedValues = 5'000'000;
// The most bins of a density.
inline constexpr int kMaxDensityBins = 1'000;
// The most draws of an expansion for quantiles and densities.
inline constexpr int kMaxDensitySamples = 200'000;

// What to compute.
struct PropagationOptions {
  double until_s = 0;                // > 0: the last time
  double step_s = 0;                 // > 0; times are 0, step, 2 step … until
  std::vector<std::string> outputs;  // names; empty: the measured ones, or all if none is
  std::vector<double> probabilities = {0.025, 0.5, 0.975};  // of the quantiles, 0 … 1
  int density_bins = 0;                                     // of each density; 0: no densities
  int density_samples = 10'000;  // draws of the expansion for quantiles and densities, ≥ 1
  int threads = 1;               // ≥ 1; results do not depend on it

  // Returns OK, or INVALID_ARGUMENT with the field, the value and the rule.
  absl::Status Validate() const;
};

// One output over time, in its unit.
struct PropagatedOutput {
  std::string output;         // its name
  std::string unit;           // "1" for a plain number; empty: the equations give none
  Vector mean;                // one for each time
  Vector standard_deviation;  // one for each time
  Matrix quantiles;           // times × probabilities
  // Root mean square of model − expansion at the collocation points, one for each time (degrees of
  // freedom Q − S): the error of the numbers above.
  Vector residual;
  std::vector<DensityEstimate> densities;  // one for each time, or none
};

// The outputs over time under the prior.
struct Propagation {
  std::vector<double> time_s;             // 0, step, 2 step …
  std::vector<PropagatedOutput> outputs;  // as asked for
  int order = 0;                          // of the expansion, p
  int terms = 0;                          // of the expansion, S
  int points = 0;                         // of collocation, Q
  std::vector<PointFailure> failures;     // points left out
};

// Computes the outputs over time under the problem's prior, on one expansion over the whole prior.
// Points that cannot be integrated are left out while more than S remain, else FAILED_PRECONDITION.
// INVALID_ARGUMENT names the field, the value and the rule.
absl::StatusOr<Propagation> PropagatePrior(const Problem& problem,
                                           const PropagationOptions& options,
                                           const Stop& stop = {});

}  // namespace polyest
