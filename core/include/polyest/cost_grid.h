#pragma once

// What the cost looks like over one or two uncertain parameters.

#include <absl/status/statusor.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "polyest/problem.h"
#include "polyest/samples.h"
#include "polyest/stop.h"
#include "polyest/types.h"

namespace polyest {

// Points of a grid past which the study is RESOURCE_EXHAUSTED.
inline constexpr int64_t kMaxGridPoints = 100'000;

// What to compute.
struct CostGridOptions {
  // One or two of the uncertain parameters; empty: the first two, or the only one.
  std::vector<std::string> parameters;
  int points = 0;  // on each axis; 0: 201 for one parameter, 41 for two
  // Values at which the other uncertain parameters are held, by name; the prior mean otherwise.
  std::map<std::string, double> held;
  // α² ≥ 0. Default: the problem's fixed one. If a rule chooses α², it must be given: the rule's
  // choice in an estimate from the same samples, Estimate::regularization.
  std::optional<double> regularization;
  int threads = 1;  // ≥ 1; results do not depend on it
};

// The cost on a grid.
struct CostGrid {
  std::vector<std::string> parameters;  // one or two names
  std::vector<std::string> units;       // of each; "1" for a plain number, empty if none is given
  std::vector<Vector> axes;             // values of each, over the prior's support or mean ± 4 σ
  Matrix mismatch;            // first axis × second axis (or × 1); +∞ where the model fails
  Matrix prior;               // +∞ at a bound where the density is 0
  Matrix total;               // mismatch + α² prior
  double regularization = 1;  // α² used
};

// Computes the cost on a grid from runs of the model itself, without an expansion. Noise of unknown
// size or correlation is marginalized; outliers are not sought. INVALID_ARGUMENT names the field
// (or row and column), the value and the rule.
absl::StatusOr<CostGrid> EvaluateCostGrid(const Problem& problem, const Samples& samples,
                                          const CostGridOptions& options, const Stop& stop = {});

}  // namespace polyest
