#pragma once

// What the prior predicts for the outputs over time, before anything is measured.
//
// The model runs at the collocation points of an expansion over the whole prior, and at draws of
// the prior that are in no fit. The results at a time are those of the expansion if its root mean
// square error at the draws is at most the standard error of a mean over them, and else those of
// the draws themselves. An expansion that follows the model is more accurate than any number of
// draws; one that does not (an oscillation whose phase varies by more than the order can follow, or
// a prior with a long tail) says something about itself and not about the model.

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <cstdint>
#include <string>
#include <vector>

#include "polyest/density.h"
#include "polyest/diagnostic.h"
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
// Draws of the prior at which the model itself runs. Fewer than the least say nothing of its
// spread; with the default a quantile is off by at most about √(p (1 − p)/512) in probability, and
// the draws reach to about three standard deviations of each germ.
inline constexpr int kPriorDraws = 512, kMinPriorDraws = 8, kMaxPriorDraws = 100'000;

// What to compute.
struct PropagationOptions {
  double until_s = 0;                // > 0: the last time
  double step_s = 0;                 // > 0; times are 0, step, 2 step … until
  std::vector<std::string> outputs;  // names; empty: the measured ones, or all if none is
  std::vector<double> probabilities = {0.025, 0.5, 0.975};  // of the quantiles, 0 … 1
  int density_bins = 0;                                     // of each density; 0: no densities
  int density_samples = 10'000;  // draws of the expansion for quantiles and densities, ≥ 1
  // Draws of the prior at which the model runs besides, kMinPriorDraws … kMaxPriorDraws. They take
  // nearly all of the time; with fewer, what the expansion does not follow is known less well.
  int draws = kPriorDraws;
  int threads = 1;  // ≥ 1; results do not depend on it

  // Returns OK, or INVALID_ARGUMENT with the field, the value and the rule.
  absl::Status Validate() const;
};

// One output over time, in its unit.
struct PropagatedOutput {
  std::string output;  // its name
  std::string unit;    // "1" for a plain number; empty: the equations give none
  Vector mean;         // one for each time
  Vector std_dev;      // one for each time
  Matrix quantiles;    // times × probabilities
  // The error of the numbers above, one for each time: the root mean square of model − expansion at
  // the draws of the prior, or the standard error of the draws' mean where they are of the draws.
  Vector residual;
  std::vector<bool> from_draws;  // one for each time: of the draws, or else of the expansion
  std::vector<DensityEstimate> densities;  // one for each time, or none
};

// The outputs over time under the prior.
struct Propagation {
  std::vector<double> time_s;             // 0, step, 2 step …
  std::vector<PropagatedOutput> outputs;  // as asked for
  int order = 0;                          // of the expansion, p
  int terms = 0;                          // of the expansion, S
  int points = 0;                         // of collocation, Q
  int draws = 0;                          // of the prior, besides
  // Trajectories left out, of the points (from 0) and of the draws (from Q).
  std::vector<PointFailure> failures;
  // kPointsFailed, and kExpansionInaccurate where numbers are of draws of which some have failed.
  std::vector<Diagnostic> diagnostics;
};

// Computes the outputs over time under the problem's prior, on one expansion over the whole prior
// and draws of it. Trajectories that cannot be integrated are left out while more than S points and
// two draws remain, else FAILED_PRECONDITION.
// INVALID_ARGUMENT names the field, the value and the rule.
absl::StatusOr<Propagation> PropagatePrior(const Problem& problem,
                                           const PropagationOptions& options,
                                           const Stop& stop = {});

}  // namespace polyest
