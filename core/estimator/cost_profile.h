#pragma once

// Profiles of the cost: J minimized over all other parameters at each of several values of one,
//   J_p(θ_i) = min over the others of J,
// on the expansion, where the posterior is. Its rise over the minimum says how well the parameter
// alone is known, whatever the others make up for: ½ at one standard deviation of a Gaussian
// posterior, 2 at two. A flat one is a parameter that is not identified, and what the others do
// along it, with which parameters it trades off.

#include <absl/status/statusor.h>

#include <string>
#include <vector>

#include "core/estimator/assessment.h"

namespace polyest {

inline constexpr int kMostProfilePoints = 1'001;

struct ProfileOptions {
  std::vector<std::string> parameters;  // uncertain ones; empty: all
  int points = 41;                      // of each profile, 3 … kMostProfilePoints

  // INVALID_ARGUMENT names the field, the value and the rule.
  absl::Status Validate(const Prior& prior) const;
};

struct CostProfile {
  std::string parameter;
  std::string unit;
  // Ascending; of each piece of a posterior in several, over four posterior standard deviations to
  // each side of the minimum, as far as Ω and the region in which the expansion is trusted go.
  Vector value;
  // J_p at each, and its parts (25).
  Vector total, mismatch, prior;
  // points × n: all parameters at the minimum for each value.
  Matrix at;
  std::vector<bool> converged;  // the minimizer's own opinion of each
};

struct CostProfiles {
  std::vector<std::string> parameters;  // the columns of `at`
  std::vector<CostProfile> profiles;
  CostValue least;                      // the cost at the minimum over all
  Vector map;                           // θ there
  std::vector<Diagnostic> diagnostics;  // those of an estimate
};

// Those of the components of a mixture as one: at every value that any of them has, the lowest. A
// component's costs count from its own height (MixtureShare::height), the first's is kept. At least
// one component, as many heights.
CostProfiles LowestOf(const std::vector<CostProfiles>& components,
                      const std::vector<double>& heights);

// options have been validated. `cost` is that of the assessment, on the design. Only a stop request
// makes it not OK.
absl::StatusOr<CostProfiles> ProfileCost(const Assessed& assessed, const Cost& cost,
                                         const ExpansionDesign& design,
                                         const ProfileOptions& options, const Stop& stop);

}  // namespace polyest
