#pragma once

// The logarithms of the posterior density and of the likelihood at given values of the parameters,
// on the expansion, with exact derivatives. With the cost J (core/README.md), the parameters
// θ = T(ξ) and the germs' prior density ρ,
//   log posterior(θ) = −J − log |det ∂θ/∂ξ| + constant,   J = J_mismatch + α² J_apriori,
//   log likelihood(θ) = −J_mismatch + constant,
// where J_mismatch includes what ended runs and a population say of the parameters. The posterior
// is a density over the parameters in their own units. Estimator::CurrentLogDensity computes both.

#include <string>
#include <vector>

#include "polyest/diagnostic.h"
#include "polyest/types.h"

namespace polyest {

// The most values that an answer may have.
inline constexpr int kMaxLogDensityValues = 5'000'000;

// What to compute.
struct LogDensityOptions {
  Matrix points;  // points × uncertain parameters, in the parameters' units; may have no rows
  int derivative_order = 0;  // the highest wanted: 0, 1 (gradients) or 2 (Hessians, too)
};

// A function of the parameters at one point.
struct LogDensityValue {
  double value = 0;  // a pure number
  Vector gradient;   // with respect to the parameters; empty unless asked for
  Matrix hessian;    // likewise
};

// The densities at several points.
struct LogDensity {
  std::vector<std::string> parameters;      // the columns of the points
  std::vector<std::string> units;           // theirs; "1" for a plain number, empty: none given
  std::vector<LogDensityValue> posterior;   // at each point
  std::vector<LogDensityValue> likelihood;  // at each point
  std::vector<Diagnostic> diagnostics;      // those of an estimate
};

}  // namespace polyest
