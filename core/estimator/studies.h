#pragma once

// Two studies that need no streaming: what the prior predicts, and what the cost looks like.

#include <absl/status/statusor.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "core/chaos/expansion.h"
#include "core/common/stop.h"
#include "core/estimator/problem.h"
#include "core/estimator/samples.h"

namespace polyest {

// Limits past which a study is RESOURCE_EXHAUSTED (bins and samples: INVALID_ARGUMENT).
inline constexpr int64_t kMostPropagatedValues = 5'000'000;  // numbers answered
inline constexpr int64_t kMostGridPoints = 100'000;
inline constexpr int kMostDensityBins = 1'000;
inline constexpr int kMostDensitySamples = 200'000;

struct PropagationOptions {
  double until_s = 0;                // > 0
  double step_s = 0;                 // > 0; times 0, step, 2 step … until
  std::vector<std::string> outputs;  // empty: the measured ones, or all if none is
  std::vector<double> probabilities = {0.025, 0.5, 0.975};
  int density_bins = 0;          // 0: no densities
  int density_samples = 10'000;  // of the expansion
  int threads = 1;

  absl::Status Validate() const;
};

struct PropagatedOutput {
  std::string output;
  std::string unit;
  Vector mean;                // one a time (11)
  Vector standard_deviation;  // one a time, (11)–(13) with the root
  Matrix quantiles;           // times × probabilities
  // Root mean square of model − expansion at the collocation points (degrees of freedom Q − S):
  // what the figures above are uncertain by.
  Vector residual;
  std::vector<DensityEstimate> densities;  // one a time, or none
};

struct Propagation {
  std::vector<double> time_s;
  std::vector<PropagatedOutput> outputs;
  int order = 0;
  int terms = 0;
  int points = 0;
  std::vector<PointFailure> failures;
};

// The outputs over time under the prior, on the fixed expansion of the problem (3)–(13). Points
// that cannot be integrated are left out while more than S remain, else FAILED_PRECONDITION.
// INVALID_ARGUMENT names the field, the value and the rule.
absl::StatusOr<Propagation> PropagatePrior(const ResolvedProblem& problem,
                                           const PropagationOptions& options, const Stop& stop);

struct CostGridOptions {
  // One or two of the uncertain parameters; empty: the first two, or the only one.
  std::vector<std::string> parameters;
  int points = 0;  // an axis; 0: 201 for one parameter, 41 for two
  // Values at which the other uncertain parameters are held, by name; the prior mean otherwise.
  std::map<std::string, double> held;
  int threads = 1;
};

struct CostGrid {
  std::vector<std::string> parameters;
  std::vector<Vector> axes;  // values of each parameter; over Ω, or mean ± 4 σ where unbounded
  Matrix mismatch;           // first axis × second axis (or × 1); +∞ where the model fails
  Matrix prior;              // +∞ at a bound where the density is 0
  Matrix total;              // mismatch + α² prior
};

// J_mismatch, J_apriori and J_total (25), (56) on a grid, from runs of the model itself and not of
// an expansion: what is drawn is the cost as it is. α² is the problem's fixed one. Noise of unknown
// size or correlation is marginalized (bayes/mismatch.h); outliers are not looked for.
// INVALID_ARGUMENT names the field (or row and column), the value and the rule.
absl::StatusOr<CostGrid> EvaluateCostGrid(const ResolvedProblem& problem, const Samples& samples,
                                          const CostGridOptions& options, const Stop& stop);

}  // namespace polyest
