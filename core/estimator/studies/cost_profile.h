#pragma once

// Profiles of the cost on the expansion, where the posterior is (polyest/cost_profile.h).

#include <absl/status/status.h>
#include <absl/status/statusor.h>

#include <vector>

#include "core/estimator/posterior/assessment.h"
#include "polyest/cost_profile.h"

namespace polyest::internal {

// INVALID_ARGUMENT names the field, the value and the rule.
absl::Status Validate(const ProfileOptions& options, const Prior& prior);

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

}  // namespace polyest::internal
