#pragma once

// Combines the components of the posterior: their weights, the choice of those to continue with,
// and the estimate of the mixture.

#include <absl/status/statusor.h>

#include <vector>

#include "core/estimator/posterior/assessment.h"
#include "polyest/stop.h"

namespace polyest::internal {

// Maximum number of components that are followed; the heaviest are kept.
inline constexpr size_t kMaxComponents = 4;
// A component of smaller weight is dropped, because it no longer affects any result.
inline constexpr double kMinWeight = 1e-6;
// A component that owns a smaller share of its draws is dropped: it has met another component.
inline constexpr double kMinOwned = 0.5;

struct MixtureWeighing {
  std::vector<size_t> kept;     // indices of the requests, ascending; at least one
  std::vector<double> weights;  // weights of those kept, Σ = 1
  double left_out = 0;          // share of those dropped for lack of room
};

// Weighs the components. Takes one request per component, at least one, all at the same row.
// Returns an error only on a stop request.
absl::StatusOr<MixtureWeighing> WeighMixture(const std::vector<AssessmentRequest>& requests,
                                             const Stop& stop);

struct AssessedMixture {
  Assessed whole;                    // for a single component, its own assessment
  std::vector<Assessed> components;  // heaviest first; empty for a single component
  std::vector<size_t> order;         // their indices among the requests; {0} for a single one
};

// Assesses the mixture. Takes one request per component, at least one, and fills in partition and
// component. If a stop has left the components at different rows, their last weights are used.
// `left_out` is that of the last weighing. Returns an error only on a stop request.
absl::StatusOr<AssessedMixture> AssessMixture(std::vector<AssessmentRequest> requests,
                                              double left_out, const Stop& stop);

}  // namespace polyest::internal
