#pragma once

// Profiles of the cost: J minimized over all other parameters at each of several values of one,
//   J_p(θ_i) = min over the others of J.
// Its rise above the minimum shows how well the parameter is known, whatever the others compensate:
// ½ at one standard deviation of a Gaussian posterior, 2 at two. A flat profile means that the
// parameter is not identified; the values of the others along it show with which parameters it
// trades off. Estimator::CurrentProfiles computes profiles.

#include <string>
#include <vector>

#include "polyest/diagnostic.h"
#include "polyest/estimate.h"
#include "polyest/types.h"

namespace polyest {

// The most points that a profile may have.
inline constexpr int kMaxProfilePoints = 1'001;

// What to compute.
struct ProfileOptions {
  std::vector<std::string> parameters;  // names of uncertain parameters; empty: all
  int points = 41;                      // of each profile, 3 … kMaxProfilePoints
};

// The profile of one parameter.
struct CostProfile {
  std::string parameter;  // its name
  std::string unit;       // "1" for a plain number; empty: the equations give none
  // Values of the parameter, ascending: over four posterior standard deviations to each side of the
  // minimum of each piece of the posterior, as far as the prior and the expansion reach.
  Vector value;
  // J_p at each value, and its parts.
  Vector total, mismatch, prior;
  Matrix at;  // values × uncertain parameters: all parameters at the minimum for each value
  std::vector<bool> converged;  // whether the minimizer converged at each value
};

// The profiles of several parameters.
struct CostProfiles {
  std::vector<std::string> parameters;  // the columns of CostProfile::at
  std::vector<CostProfile> profiles;    // one for each parameter asked for
  CostValue least;                      // the cost at the minimum over all parameters
  Vector map;                           // the parameters there
  std::vector<Diagnostic> diagnostics;  // those of an estimate
};

}  // namespace polyest
