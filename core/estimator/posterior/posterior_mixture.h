#pragma once

// The posterior of several components as one: their weights, which of them to go on with, and the
// estimate of the mixture.

#include <absl/status/statusor.h>

#include <vector>

#include "core/estimator/posterior/assessment.h"
#include "polyest/stop.h"

namespace polyest::internal {

// So many components at most, the heaviest, are followed.
inline constexpr size_t kMaxComponents = 4;
// A component of less weight is dropped: what it says no longer changes any answer.
inline constexpr double kMinWeight = 1e-6;
// So is one more than half of whose draws are other components' own: they have met.
inline constexpr double kMinOwned = 0.5;

struct MixtureWeighing {
  std::vector<size_t> kept;     // of the requests, ascending; at least one
  std::vector<double> weights;  // of those, Σ = 1
  double left_out = 0;          // share of those for which there was no room
};

// One request a component, at least one, all of the same rows. Only a stop request makes it not OK.
absl::StatusOr<MixtureWeighing> WeighMixture(const std::vector<AssessmentRequest>& requests,
                                             const Stop& stop);

struct AssessedMixture {
  Assessed whole;                    // of a single component, that one's
  std::vector<Assessed> components;  // of several, heaviest first; empty of a single one
  std::vector<size_t> order;         // their places among the requests; {0} of a single one
};

// One request a component, at least one; partition and component are filled in. Where a stop has
// left the components at different rows their last weights are taken. left_out: as of the last
// weighing. Only a stop request makes it not OK.
absl::StatusOr<AssessedMixture> AssessMixture(std::vector<AssessmentRequest> requests,
                                              double left_out, const Stop& stop);

}  // namespace polyest::internal
