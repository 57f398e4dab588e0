#pragma once

// Profiles of the cost on the expansion around the posterior (polyest/cost_profile.h).

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <vector>

#include "core/estimator/posterior/assessment.h"
#include "polyest/cost_profile.h"

namespace polyest::internal {

// Returns InvalidArgument that names the field, the value and the rule if the options are invalid.
absl::Status Validate(const ProfileOptions& options, const Prior& prior);

// Combines the profiles of a mixture's components: at every value that any of them has, the lowest
// cost. A component's costs are relative to its own height (MixtureShare::height); the result uses
// the height of the first. Takes at least one component, and as many heights.
CostProfiles LowestOf(const std::vector<CostProfiles>& components,
                      const std::vector<double>& heights);

// Computes the profiles. `options` must be valid. `cost` is the cost of the assessment, on the
// design. Returns an error only on a stop request.
absl::StatusOr<CostProfiles> ProfileCost(const Assessed& assessed, const Cost& cost,
                                         const ExpansionDesign& design,
                                         const ProfileOptions& options, const Stop& stop);

}  // namespace polyest::internal
